"""The header line of every generated text: one JSON object with the text's origin."""

import json
from collections.abc import Mapping
from typing import Any

from ...ir.program import Program
from ...model.errors import UserError
from ...model.model import Model, level_networks, sizes
from ...model.version import installed_version

PREFIX = "// "
"""Start of the header line, before its JSON object."""


def header_facts(model: Model, program: Program, target: str) -> dict[str, Any]:
    """Return the facts of every header.

    They are the version of mplicits, the target, the model's name, the first 12 digits of its hash, the shape of each
    level's network, and the model's front and credit, if any.
    """
    further = {"front": model.front, "credit": model.credit or None}
    return {
        "mplicits": installed_version(),
        "target": target,
        "name": program.name,
        "sha256": program.sha256[:12],
        "levels": [sizes(level_networks(model, i)) for i in range(len(model.levels))],
    } | {key: value for key, value in further.items() if value is not None}


def header_line(facts: Mapping[str, Any], comment: str = "//") -> str:
    """Return the header line: a comment with one JSON object.

    JSON escapes any text in a model's name: the line is ASCII, without a line break, and has no backslash at its end.
    """
    return f"{comment} {json.dumps(facts)}"


def read_header(text: str) -> dict[str, Any]:
    """Read the facts from the header line of a generated text; `#version` and `precision` lines may precede it.

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
