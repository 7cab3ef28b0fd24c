"""Target html: one page that shows the model, from a file, without a network. Its source is the folder web/."""

import base64
import json
import re
from dataclasses import replace
from importlib.resources import files
from typing import Any

import numpy as np

from ... import glsl
from ...model.errors import UserError
from ...model.model import Model, level_numbers, to_bytes
from ..ir.lower import lower
from ..ir.program import Array, Program
from ..printers.field import STORAGES, print_field
from ..reference import interpret
from ..reference.digits import near_surface
from ..reference.rounding import in_decimals, is_float16
from . import fragment
from .glsl300es import DIALECT
from .header import header_facts, installed_version
from .uniforms import UNIFORMS

PRINTER = ("safetensors.js", "lower.js", "cstyle.js", "literal.js", "texture.js", "field.js")
"""Modules in web/ that read a model and print its field."""
SCRIPTS = (
    *PRINTER,
    "reference.js",
    "camera.js",
    "uniforms.js",
    "device.js",
    "painter.js",
    "variants.js",
    "renderer.js",
    "memory.js",
    "messages.js",
    "gestures.js",
    "controls.js",
    "view.js",
    "shown.js",
    "page.js",
)
"""All modules in web/, in the order in which the page's one script holds them."""
PROBES = 32
"""Points at which the page compares its field with the reference's."""

_MODULE_LINE = re.compile(r"^import [^;]*;\n|^export (?=\w)", re.MULTILINE)
_PLACE = re.compile(r"\{\{(\w+)\}\}")


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """The page.

    storage: the page draws from a texture at once; "auto" has it compile literals (networks up to 64 wide) beside that
    and keep what is faster there, "literal" wider ones too, "texture" none.
    Weights that 16-bit floats hold exactly travel as such.
    """
    weights = model if digits is None else in_decimals(model, digits)
    if storage == "packed":
        raise UserError("--storage packed: only shadertoy has it; there is literal, texture, auto")
    program = lower(weights)
    field = print_field(program, DIALECT.language, "texture")
    # A model that is dropped on the page may move, even if this one does not.
    facts = header_facts(model, program, "html")
    prologue = fragment.prologue(facts, replace(program, moving=True), DIALECT, field.weights)
    parts = {
        "css": _read("page.css"),
        "js": script(),
        "model": _json(_facts(model, program, storage, digits)),
        "weights": _wrapped(base64.b64encode(_bytes(weights)).decode()),
        "prologue": _shader(prologue),
        **{name: _shader(glsl.load(f"{name}.glsl")) for name in ("main", "accumulate", "present")},
    }
    return _PLACE.sub(lambda match: parts[match[1]], _read("page.html"))


def script(names: tuple[str, ...] = SCRIPTS) -> str:
    """Modules of web/ as one."""
    return "".join(_MODULE_LINE.sub("", _read(name)) for name in names)


def _facts(model: Model, program: Program, storage: str, digits: int | None) -> dict[str, Any]:
    points = _probes(program)
    narrow = any(program.widest(function) <= STORAGES[0][0] for function in program.functions())
    return {
        "sha256": program.sha256,
        "version": installed_version(),
        "defaults": {entry.name: list(entry.default) for entry in UNIFORMS if isinstance(entry.default, tuple)},
        "storage": storage if narrow or storage == "literal" else "texture",
        "points": _numbers(points),
        "values": _numbers(interpret.field(program, points, len(program.values))),
        "shadertoy": _shadertoy(model, digits),
    }


def _probes(program: Program) -> Array:
    """Points (N, 3) near the surface, within every level's band and the ball that rays are traced in."""
    points = near_surface(program)
    points = points[np.linalg.norm(points, axis=1) < 1]
    _, reached = interpret.nested_field(program, points, len(program.values))
    found: Array = points[reached == len(program.values)][:PROBES]
    return found


def _shadertoy(model: Model, digits: int | None) -> str | None:
    """What the button "Copy as Shadertoy" copies; None, and no button, where that target refuses the model."""
    from .registry import TARGETS  # here, for it imports this module

    if "shadertoy" not in TARGETS:
        return None
    try:
        return TARGETS["shadertoy"](model, digits=digits)
    except UserError:
        return None


def _bytes(model: Model) -> bytes:
    """A model file without its provenance, in 16-bit floats where they hold every weight."""
    description = {
        "name": model.name,
        "levels": [level_numbers(level) for level in model.levels],
        "inputs": model.inputs,
        "centre": list(model.centre),
        "scale": model.scale,
        "provenance": {},
    }
    kind = np.float16 if is_float16(model) else np.float32
    return to_bytes({name: tensor.astype(kind) for name, tensor in model.tensors().items()}, description)


def _numbers(values: np.ndarray) -> list[float]:
    """Flat; each the shortest that reads back as the same float32."""
    return [float(str(value)) for value in np.asarray(values, np.float32).ravel()]


def _json(value: object) -> str:
    """JSON that may stand in a script element: nothing in it opens or closes a tag or a comment."""
    return json.dumps(value).replace("<", "\\u003c")


def _shader(text: str) -> str:
    """GLSL that may stand in a script element; only the name in a comment, which is JSON, can hold a tag."""
    return re.sub(r"<(?=[/!s])", r"\\u003c", text)


def _wrapped(text: str) -> str:
    return "\n".join(text[i : i + 120] for i in range(0, len(text), 120))


def _read(name: str) -> str:
    return files(__package__).joinpath("web", name).read_text(encoding="utf-8")
