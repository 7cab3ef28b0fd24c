"""The first line of every generated text: one JSON object that says what the text was made from, and by what."""

import json
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ...model.errors import UserError
from ...model.model import Model, shape_of
from ..ir.program import Program

PREFIX = "// "


def header_facts(model: Model, program: Program, target: str) -> dict[str, Any]:
    """What every header says: mplicits' version, the target, and the model's name, hash (its start) and levels."""
    return {
        "mplicits": installed_version(),
        "target": target,
        "name": program.name,
        "sha256": program.sha256[:12],
        "levels": [shape_of(level.network) for level in model.levels],
    }


def header_line(facts: Mapping[str, Any]) -> str:
    """The line, a comment in every C-like language.

    JSON escapes whatever a name may hold: the line is ASCII, has no line break inside and no backslash at its end.
    """
    return PREFIX + json.dumps(facts)


def read_header(text: str) -> dict[str, Any]:
    """The header of a generated text, which may follow its `#version` and `precision` lines.

    Raises UserError where there is none.
    """
    line = next((line for line in text.splitlines() if line.startswith(PREFIX + "{")), "")
    try:
        facts = json.loads(line.removeprefix(PREFIX))
    except ValueError:
        facts = None
    if not isinstance(facts, dict) or "mplicits" not in facts:
        raise UserError("no header line of mplicits; bake it with --target glsl330")
    return facts


def installed_version() -> str:
    """The version of mplicits that writes."""
    try:
        return version("mplicits")
    except PackageNotFoundError:
        return "(not installed)"
