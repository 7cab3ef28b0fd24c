"""Compares shader texts, except for their version, with golden files; --update-golden writes them."""

import re
from pathlib import Path

import pytest


def check_golden(text: str, path: Path, request: pytest.FixtureRequest) -> None:
    """Assert that a text equals the golden file; with --update-golden, write it there first."""
    text = re.sub(r'(?<="mplicits": )"[^"]*"', '"VERSION"', text)
    if request.config.getoption("--update-golden"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), "run pytest --update-golden after reading the difference"
