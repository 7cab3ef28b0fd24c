"""Target tiny: a web page of few bytes, which draws Shadertoy's text with weights of few bits (docs/web.md)."""

import html
import json
import math
import re
from dataclasses import replace
from typing import Any

import numpy as np

from ..codegen.printers.cstyle import Language
from ..codegen.printers.packed import PackedStorage, Whole, multiples, whole_layer
from ..codegen.targets.baked import Baked
from ..codegen.targets.orbit import AZIMUTH, ELEVATION
from ..codegen.targets.shadertoy import Emitted, emitted, storage_without_search
from ..codegen.targets.shadertoy_text import printed_functions, shader_text, weights_text
from ..ir.program import Affine, Dot, Function, Program
from ..model.model import Model
from ..model.version import installed_version
from .base124 import base124
from .bundle import read
from .deflate import deflated
from .minified import minified
from .policy import hash_of

HEAD = (
    "#version 300 es\nprecision highp float;precision highp int;"
    "uniform vec4 iResolution,iView;uniform int iFrame;out vec4 iColor;\n"
    "#define iTime iResolution.z\n#define AA int(iResolution.w)\n"
)
"""iView: azimuth, elevation, zoom, and what is added to the background. iFrame is 0, so that loops are not unrolled.

Shadertoy's inputs begin with i and a capital letter. Its text declares no such name, so the page's own have this form.
"""
MAIN = "void main(){mainImage(iColor,gl_FragCoord.xy);}"
CAMERA = {
    "radians(VIEW)+vec2(SPEED*iTime,0)-3.14*(iMouse.xy-abs(iMouse.zw))/z": "iView.xy",
    "a.y=clamp(a.y,-1.4,1.4);\n": "",
    "float z=min(r.x,r.y)": "float z=iView.z*min(r.x,r.y)",
    "mix(BOTTOM,TOP,u.y/r.y)": "mix(BOTTOM,TOP,u.y/r.y)+iView.w",
}
"""Text of glsl/functions/shadertoy.glsl -> the page's, whose script limits the elevation."""
DROPPED = re.compile(r"(?m)^//.*\n|^#define (?:VIEW|SPEED|AA)\b.*\n|(?<=\S) // .*$")
"""Comments, and settings that the page's script has instead."""
GL = {
    "COLOR_ATTACHMENT0": 36064,
    "COLOR_BUFFER_BIT": 16384,
    "DRAW_FRAMEBUFFER": 36009,
    "FRAGMENT_SHADER": 35632,
    "FRAMEBUFFER": 36160,
    "LINK_STATUS": 35714,
    "LINEAR": 9729,
    "RENDERBUFFER": 36161,
    "RGBA8": 32856,
    "SCISSOR_TEST": 3089,
    "SYNC_GPU_COMMANDS_COMPLETE": 37143,
    "SYNC_STATUS": 37140,
    "TRIANGLES": 4,
    "UNSIGNALED": 37144,
    "VERTEX_SHADER": 35633,
}
"""Constants of WebGL, which are shorter as numbers."""
SMALL = 127
"""Largest number of one byte."""
POLICY = "default-src 'none';script-src {{scripts}}"
"""The Content-Security-Policy."""
WEIGHTS = "@"
"""In the shader, the place of the networks, which the script prints."""


def baked(model: Model, storage: str = "auto", digits: int | None = None, shade: str | None = None) -> Baked:
    """Return the page, and how far its weights are rounded. Arguments and errors: see `codegen.targets.shadertoy`."""
    chosen = emitted(model, storage, digits)
    return replace(written(script_parts(chosen, model, shade), model), rounding=chosen.rounding)


def exact(model: Model) -> str:
    """Return a page without a search for the fewest bits, which is at least as long."""
    return baked(model, storage_without_search(model)).text


def script_parts(chosen: Emitted, model: Model, shade: str | None) -> tuple[dict[str, Any], bytes]:
    """Return the values that tiny/draw.js needs, and the bytes of weights: none where the shader has them as text."""
    program = chosen.program
    shader = shader_text(program, model, chosen.storage, {}, shade)
    networks, weights = [], bytearray()
    if chosen.storage is PackedStorage and program.composition is None:
        shader = _replaced(shader, weights_text(program, PackedStorage), WEIGHTS)
        networks = [_network(program, function, weights) for function in printed_functions(program)]
    for text, replacement in CAMERA.items():
        shader = _replaced(shader, text, replacement)
    view = [math.radians(angle) for angle in model.front or (AZIMUTH, ELEVATION)]
    values = {
        "NETWORKS": networks,
        "VIEW": [round(angle, 3) for angle in view],
        "MOVES": int(program.moving),
        "SHADER": HEAD + DROPPED.sub("", shader) + MAIN,
    }
    return values, bytes(weights)


def written(parts: tuple[dict[str, Any], bytes], model: Model) -> Baked:
    """Return the page and its policy. parts: of `script_parts`."""
    values, weights = parts
    script = f"{{{minified(_filled(_drawing(), values))}}}"  # a block of its own names
    data = deflated(script.encode() + b"\0" + weights)
    by = f" by {model.credit}" if model.credit else ""
    fixed = _fixed_slots()
    slots = {
        "title": _escaped(model.name),
        "label": _escaped(model.name + by),
        "packed": base124(data),
        "scripts": f"{hash_of(fixed['unpack'])} {hash_of(script)}",
    }
    return Baked(_filled_slots(_template(), slots | fixed), policy=_filled_slots(POLICY, slots))


def page_facts() -> dict[str, Any]:
    """Return what the studio's page needs to write a tiny page: texts of script and page, with names to fill in."""
    fixed = _fixed_slots()
    return {
        "script": f"{{{minified(_drawing())}}}",
        "page": _filled_slots(_template(), fixed),
        "unpacker": hash_of(fixed["unpack"]),
        "head": HEAD,
        "main": MAIN,
        "camera": CAMERA,
        "dropped": DROPPED.pattern.removeprefix("(?m)"),
    }


def _drawing() -> str:
    """Return the text of draw.js, with WebGL's constants as numbers."""
    return re.sub(r"\bgl\.([A-Z]\w+)", lambda match: str(GL[match[1]]), read("tiny/draw.js"))


def _template() -> str:
    return _filled_slots(read("tiny/page.html"), {"policy": POLICY})


def _fixed_slots() -> dict[str, str]:
    return {"version": installed_version(), "unpack": minified(read("tiny/unpack.js"))}


def _filled_slots(text: str, slots: dict[str, str]) -> str:
    """Replace `{{name}}` in one pass, and leave the names that `slots` lacks."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: slots.get(match[1], match[0]), text)


def _network(program: Program, function: Function, weights: bytearray) -> list[Any]:
    """Add the weights of a network, and return its description for tiny/draw.js."""
    number = Language().number
    layers = []
    for op in function.ops:
        if isinstance(op, Affine):
            layer = whole_layer(program, op)
            halves = [_add(layer.weights, weights), _add(layer.bias, weights)]
            factors = [[number(factor) for factor in layer.inputs]] if layer.inputs else []
            layers.append([*layer.weights.shape, *halves, number(layer.step), *factors])
    outputs = []
    for op in function.ops:
        if isinstance(op, Dot):
            row, _, step = multiples(program.constants[op.row])
            outputs.append([_add(row, weights), number(step * op.scale), f"({number(op.bias)})"])
    return ["float" if len(outputs) == 1 else "vec3", function.name, layers, outputs]


def _add(numbers: Whole, weights: bytearray) -> int:
    """Add numbers as bytes, and return the largest: no bytes for zeros; above 127 two each, and all high ones first."""
    half = int(np.abs(numbers).max(initial=0))
    planes = numbers.ravel().astype("<i2").view(np.uint8).reshape(-1, 2)
    weights += (planes[:, 1].tobytes() if half > SMALL else b"") + (planes[:, 0].tobytes() if half else b"")
    return half


def _filled(text: str, values: dict[str, Any]) -> str:
    """Replace names by values, as JSON that holds no end of a script."""
    pattern = re.compile(rf"\b(?:{'|'.join(values)})\b")
    return pattern.sub(lambda match: json.dumps(values[match[0]], separators=(",", ":")), text)


def _replaced(text: str, old: str, new: str) -> str:
    if (count := text.count(old)) != 1:
        raise ValueError(f"Shadertoy's text has {old[:40]!r} {count} times instead of once")
    return text.replace(old, new)


def _escaped(text: str) -> str:
    """Return text for HTML, in printable ASCII."""
    kept = "".join(letter for letter in text if letter.isprintable())
    return html.escape(kept, quote=False).encode("ascii", "xmlcharrefreplace").decode()
