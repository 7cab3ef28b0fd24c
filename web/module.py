"""Target module: an ES module with the element <mplicits-view> and with createMesh for three.js (docs/engines.md)."""

import base64
from dataclasses import replace
from importlib.resources import files

from .. import glsl
from ..codegen.printers.field import print_field
from ..codegen.targets import fragment
from ..codegen.targets.glsl300es import DIALECT
from ..codegen.targets.header import header_facts, header_line
from ..codegen.targets.uniforms import OPENING_SHADES
from ..field.lowest import lowest_point
from ..field.rounding import in_decimals
from ..ir.lower import lower
from ..model.errors import UserError
from ..model.model import Model
from ..model.version import installed_version
from .facts import facts_json
from .minified import short_script
from .page import MODULE_LINE, model_bytes, poster_url, script
from .scene import scene_facts, texel_bytes

APP = (
    *("packed_weights.js", "safetensors.js", "lower.js", "cstyle.js", "literal.js", "texels.js", "field.js"),
    *("baked_scene.js", "reference.js", "cells.js", "lowest.js", "camera.js", "backgrounds.js", "uniforms.js"),
    *("device.js", "samples.js", "passes.js", "painter.js", "variants.js", "renderer.js", "memory.js", "gestures.js"),
)
"""Modules in web/app/ that the module shares with the page, in their order."""
ELEMENT = (*("models.js", "orbits.js", "stage.js", "view_element.js", "lights.js", "rays.js", "mesh.js"),)
"""Modules in web/element/, in their order."""
SHADERS = ("anywhere", "accumulate", "present", "contrast", "scatter", "scatter.vert", "sine", "half_width")
"""Files in glsl/ with the shaders of the module."""
HULL = ("hull.vert.glsl", "hull.frag.glsl", "hull_color.frag.glsl", "hull_depth.frag.glsl")
"""Files in web/element/ with the shaders for three.js."""
EXPORTS = ("MplicitsView", "createMesh", "loadModel", "ownModel")
"""What the module exports."""


def standalone(
    model: Model,
    storage: str = "auto",
    digits: int | None = None,
    poster: bool = True,
    shade: str = OPENING_SHADES[0],
) -> str:
    """Return the text of the module, with the model in it.

    digits: decimals of the weights, None for exact weights. poster: include a small picture of the model, which takes
    seconds to draw. shade: shading of elements without `shade`, one of OPENING_SHADES. Raises UserError for a storage
    other than "auto" or "texture".
    """
    if storage not in ("auto", "texture"):
        raise UserError(f"--storage {storage}: module has its weights in a texture; leave the option out")
    weights = model if digits is None else in_decimals(model, digits)
    program = lower(weights)
    text = print_field(program, DIALECT.language, "texture")
    header = header_facts(model, program, "module")
    ground = round(lowest_point(program), 4)
    facts = header | {"ground": ground, "shade": shade, "poster": poster_url(model, shade) if poster else None}
    if model.scene is not None:
        facts["scene"] = scene_facts(model, program, text)
    data = model_bytes(weights) if model.scene is None else texel_bytes(text)
    facts["weights"] = base64.b64encode(data).decode()
    # moving: a model in a file may move.
    prologue = fragment.prologue(header, replace(program, moving=True), DIALECT, text.weights, ground)
    facts["shaders"] = _shaders(prologue)
    lines = [
        header_line(header),
        f"const facts = {facts_json(facts)}, {{shared}} = facts;",
        short_script(script(APP) + "".join(MODULE_LINE.sub("", _read(name)) for name in ELEMENT)),
        f"export {{{', '.join(EXPORTS)}}};",
    ]
    return "\n".join(lines) + "\n"


def types() -> str:
    """Return the declarations of the module for TypeScript."""
    return header_line({"mplicits": installed_version(), "target": "module"}) + "\n" + _read("module.d.ts")


def _shaders(prologue: str) -> dict[str, str]:
    """Return the shaders' files by their names, without comments. prologue: text before the field."""
    names = dict.fromkeys(name for shader in SHADERS for name in glsl.load_numbered(f"{shader}.glsl")[1])
    texts = {"prologue": prologue} | {name: glsl.read(name) for name in names} | {name: _read(name) for name in HULL}
    return {name: short_script(text) for name, text in texts.items()}


def _read(name: str) -> str:
    return files(__package__).joinpath("element", name).read_text(encoding="utf-8")
