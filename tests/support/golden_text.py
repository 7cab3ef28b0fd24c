"""Golden shader texts: compared without the version that wrote them, written by --update-golden alone."""

import re
from pathlib import Path

import pytest


def check_golden(text: str, path: Path, request: pytest.FixtureRequest) -> None:
    """Assert that `text` is the file's, or write it there where --update-golden is given."""
    text = re.sub(r'(?<="mplicits": )"[^"]*"', '"VERSION"', text)
    if request.config.getoption("--update-golden"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), "run pytest --update-golden after reading the difference"
