"""Target module: an ES module with the element <mplicits-view> and with createMesh for three.js (docs/engines.md)."""

import base64
from collections.abc import Callable
from dataclasses import replace

from .. import glsl
from ..codegen.printers.field import print_field
from ..codegen.targets import fragment
from ..codegen.targets.baked import Baked
from ..codegen.targets.glsl300es import DIALECT
from ..codegen.targets.header import header_facts, header_line
from ..codegen.targets.uniforms import OLD_SHADES, OPENING_SHADES
from ..field.lowest import lowest_point
from ..ir.lower import lower
from ..model.errors import UserError
from ..model.model import Model
from ..model.version import installed_version
from .bundle import modules, read, script
from .facts import facts_json
from .minified import minified, short_names, short_shader
from .page import model_bytes, poster_url
from .scene import scene_facts, texel_bytes
from .weights import ShortWeights, coded_weights, page_weights, short_weights

ENTRIES = ("define.js", "mesh.js", "models.js")
"""The scripts with what the module exports, and with all that they import."""
NO_LITERALS = "const declareLiterals = () => [], straight = null;\n"
"""Stands for literal.js, since the module has its weights in a texture."""
GIVEN = ("facts.js", "literal.js")
"""Scripts that the module has no use for: its facts stand in its text."""
SHADERS = ("single_pass", "accumulate", "present", "contrast", "scatter", "scatter.vert", "sine", "half_width")
"""Files in glsl/ with the shaders of the module."""
UNREAD = ("shapes", "storages", "frame", "shading_labels", "shading_keys")
"""Constants that only pages read."""
ROOTS = tuple(f"{name}.glsl" for name in (*SHADERS, "skip", "march"))
"""Files in glsl/ that scripts ask for."""
HULL = ("hull.vert.glsl", "hull.frag.glsl", "hull_color.frag.glsl", "hull_depth.frag.glsl")
"""Files in web/element/ with the shaders for three.js."""
EXPORTS = ("MplicitsView", "createMesh", "loadModel", "ownModel")
"""What the module exports."""


def baked(
    model: Model,
    storage: str = "auto",
    digits: int | None = None,
    poster: bool = True,
    shade: str = OPENING_SHADES[0],
) -> Baked:
    """Return the module with the model in it, and how far its weights are rounded.

    digits: decimals of the weights, None for exact weights. poster: include a small picture of the model, which takes
    seconds to draw. shade: shading of elements without `shade`, one of OPENING_SHADES. Raises UserError for a storage
    other than "auto" or "texture".
    """
    return _baked(model, storage, digits, poster, shade, coded_weights)


def exact(model: Model, poster: bool = True) -> str:
    """Return a module without a search for the fewest bits, which is at least as long."""
    return _baked(model, "auto", None, poster, OPENING_SHADES[0], short_weights).text


def _baked(
    model: Model,
    storage: str,
    digits: int | None,
    poster: bool,
    shade: str,
    shorten: Callable[[Model], ShortWeights | None],
) -> Baked:
    """Return the module. shorten: rounds weights. The other arguments are those of `baked`."""
    if storage not in ("auto", "texture"):
        raise UserError(f"--storage {storage}: module has its weights in a texture; leave the option out")
    chosen = page_weights(model, digits, shorten)
    program = replace(lower(chosen.model), sha256=model.sha256())
    text = print_field(program, DIALECT.language, "texture")
    header = header_facts(model, program, "module")
    ground = round(lowest_point(program), 4)
    facts = header | {"ground": ground, "shade": shade, "poster": poster_url(model, shade) if poster else None}
    if model.scene is not None:
        facts["scene"] = scene_facts(model, program, text)
        data = texel_bytes(text)
    else:
        data = chosen.data or model_bytes(chosen.model)
    # moving: a model in a file may move.
    prologue = fragment.prologue(header, replace(program, moving=True), DIALECT, text.weights, ground)
    names = f"{{{', '.join(EXPORTS)}}}"
    scripts = NO_LITERALS + script(tuple(name for name in modules(*ENTRIES) if name not in GIVEN))
    code = minified(f"{scripts}return {names};")
    shaders = short_names(_shaders(prologue), code + facts_json(facts))
    facts |= {"old_shades": OLD_SHADES, "weights": base64.b64encode(data).decode(), "shaders": shaders}
    lines = [
        header_line(header),
        f"const facts = {facts_json(facts, UNREAD)}, {{shared}} = facts;",
        f"const {names} = (() => {{{code}}})();",
        f"export {names};",
    ]
    return Baked("\n".join(lines) + "\n", chosen.line)


def types() -> str:
    """Return the declarations of the module for TypeScript."""
    return header_line({"mplicits": installed_version(), "target": "module"}) + "\n" + read("element/module.d.ts")


def _shaders(prologue: str) -> dict[str, str]:
    """Return the shaders' files by their names, without comments. prologue: text before the field.

    A file that one other includes is in that one's text.
    """
    names = dict.fromkeys(name for shader in SHADERS for name in glsl.load_numbered(f"{shader}.glsl")[1])
    texts = {"prologue": prologue} | {name: glsl.read(name) for name in names}
    texts |= {name: read(f"element/{name}") for name in HULL}
    for name in (name for name in names if name not in ROOTS):
        line = f'#include "{name}"\n'
        including = [other for other, text in texts.items() if line in text]
        if len(including) == 1:
            texts[including[0]] = texts[including[0]].replace(line, texts.pop(name))
    return {name: short_shader(text) for name, text in texts.items()}
