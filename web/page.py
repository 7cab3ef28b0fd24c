"""Target html: one page that shows the model offline. Its style and HTML are in view/."""

import base64
import io
import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import glsl
from ..codegen.printers.field import PLAIN, STORAGES, print_field
from ..codegen.targets import fragment, orbit
from ..codegen.targets.baked import Baked
from ..codegen.targets.camera import basis, fitting_distance
from ..codegen.targets.glsl300es import DIALECT
from ..codegen.targets.header import header_facts
from ..codegen.targets.reserved_names import lower_case_pattern
from ..codegen.targets.shadertoy_text import main_template
from ..codegen.targets.uniforms import OPENING_SHADES, default
from ..field import interpret
from ..field.lowest import lowest_point
from ..field.poster import poster as draw_poster
from ..field.rounding import is_float16
from ..field.surface_points import near_surface
from ..ir.lower import lower
from ..ir.program import Array, Program
from ..model.errors import UserError
from ..model.model import Model
from ..model.model_file import to_bytes
from ..model.version import installed_version
from .document import NO_PICTURE, Page, Studio, packed
from .facts import PAGE_FRAME
from .scene import scene_facts, texel_bytes
from .weights import page_weights, short_weights

POSTER_SIDE = 160
"""Pixels along each side of the picture that the page shows before its first frame."""
POSTER_QUALITY = 50
"""Quality of its WebP, from 0 to 100."""
SHADERS = (
    *("single_pass", *dict.fromkeys(PAGE_FRAME.values()), "accumulate", "present"),
    *("blocks.vert", "contrast", "scatter", "scatter.vert"),
)
"""Files in glsl/ with the shaders of the page."""
PROBES = 8
"""Largest number of points at which the page checks its field."""


def standalone(model: Model, **options: Any) -> str:
    """Return the text of the page, packed. options: of `page_of`. Raises UserError."""
    return baked(model, **options).text


def baked(model: Model, **options: Any) -> Baked:
    """Return the page, packed, and how far its weights are rounded. options: of `page_of`. Raises UserError."""
    page, rounding = page_of(model, **options)
    return replace(packed(page), rounding=rounding)


def page_of(
    model: Model,
    storage: str = "auto",
    digits: int | None = None,
    poster: bool = True,
    shade: str = OPENING_SHADES[0],
    studio: Studio | None = None,
    address: str = "",
    preview: str = "",
) -> tuple[Page, str | None]:
    """Return the page of a model, and the line about its rounded weights.

    storage: "texture" stores the weights in a texture. "auto" also compiles them as literals, for networks up to 64
    wide, and keeps the faster variant; "literal" does so for wider networks too. digits: decimals of the weights, None
    for all. Weights are short whole numbers where that keeps the field (weights.py), unless they are 16-bit
    floats. poster: include a small picture of the model, which takes seconds to draw. shade: initial shading, one of
    OPENING_SHADES. studio: what the page that trains has beyond. address, preview: see `about`. Raises UserError for
    another storage.
    """
    chosen = page_weights(model, digits, None if studio else short_weights)
    weights = chosen.model
    if storage == "packed":
        raise UserError("--storage packed: only target shadertoy takes it; choose literal, texture or auto")
    program = lower(weights)
    if chosen.data:  # The page names the model's own hash.
        program = replace(program, sha256=model.sha256())
    text = print_field(program, DIALECT.language, "texture" if model.scene is None else storage)
    header = header_facts(model, program, "html")
    # moving: a model dropped on the page may move.
    ground = round(lowest_point(program), 4)
    prologue = fragment.prologue(header, replace(program, moving=True), DIALECT, text.weights, ground)
    facts = header | {"ground": ground} | _facts(program, storage) | {"shade": shade}
    if model.scene is not None:
        facts["scene"] = scene_facts(model, program, text)
        data = texel_bytes(text)
    else:
        data = chosen.data or model_bytes(weights)
    picture = poster_url(model, shade) if poster else NO_PICTURE
    return Page(model.name, facts, data, _shaders(prologue), picture, address, preview, studio), chosen.line


def empty_page(name: str, shade: str = OPENING_SHADES[0], studio: Studio | None = None) -> Page:
    """Return a page that shows no model until a file is dropped. name: its title. shade, studio: see `page_of`."""
    facts = {"mplicits": installed_version(), "target": "html", "name": name}
    program = Program(name, "", (), (), (), None, {}, moving=True)
    prologue = fragment.prologue(facts, program, DIALECT, np.zeros((1, 1, 4), np.float32), 0.0)
    return Page(name, facts | {"shade": shade}, b"", _shaders(prologue), studio=studio)


def text_facts() -> dict[str, str]:
    """Return the keys of `facts` that print/glsl_function.js needs, beyond the header's."""
    return {"reserved": lower_case_pattern("glsl")}


def _facts(program: Program, storage: str) -> dict[str, Any]:
    """Return the facts about the page's own model beyond the header's, with `sha256` in full."""
    points = _probes(program)
    widest = [program.widest(function) for function in program.functions()]
    literal = program.composition is None and (storage == "literal" or min(widest) <= STORAGES[0][0])
    return {
        "sha256": program.sha256,
        "storage": storage if literal else "texture",
        "points": _numbers(points),
        "values": _numbers(np.round(interpret.field(program, points, len(program.bands)), 8)),
    }


def _probes(program: Program) -> Array:
    """Return points (N, 3) float32 near the surface at time 0, in every level's band and in the unit ball."""
    points = np.round(near_surface(program), 4)
    points = points[np.linalg.norm(points, axis=1) < 1]
    _, reached = interpret.nested_field(program, points, len(program.bands))
    probes: Array = points[reached == len(program.bands)][:PROBES]
    return probes


def model_bytes(model: Model) -> bytes:
    """Return a model file without its provenance, in 16-bit floats if they are exact."""
    return to_bytes(replace(model, provenance={}), np.float16 if is_float16(model) else np.float32)


def poster_pixels(model: Model, side: int, shade: str = "phong") -> NDArray[np.uint8]:
    """Draw the first view of the page at time 0: (side, side, 4) uint8, sRGB and coverage, top row first.

    shade: one of OPENING_SHADES; softbox has no floor here.
    """
    azimuth, elevation = model.front or (orbit.AZIMUTH, orbit.ELEVATION)
    focal = 1 / math.tan(math.radians(orbit.FOV) / 2)
    light, plain = np.array(default("light")), np.array([float(c) for c in PLAIN.split(",")])
    view = basis(azimuth, elevation), fitting_distance(1.0, focal), focal
    return np.round(255 * draw_poster(model, *view, light, plain, side, shade)).astype(np.uint8)


def poster_url(model: Model, shade: str, side: int = POSTER_SIDE) -> str:
    """Return the first view of the page as the data URL of a WebP: some 3 kB. side, shade: see `poster_pixels`."""
    from PIL import Image

    data = io.BytesIO()
    pixels = poster_pixels(model, side, shade)
    Image.fromarray(pixels).save(data, "WEBP", quality=POSTER_QUALITY, method=6)
    return "data:image/webp;base64," + base64.b64encode(data.getvalue()).decode()


def _numbers(values: np.ndarray) -> list[float]:
    """Return all values in one list, each as the shortest number of the same float32."""
    return [float(str(value)) for value in np.asarray(values, np.float32).ravel()]


def _shaders(prologue: str) -> dict[str, str]:
    """Return the GLSL of the page by the ids of its elements: prologue, the files of SHADERS, Shadertoy's template."""
    names = dict.fromkeys(name for shader in SHADERS for name in glsl.load_numbered(f"{shader}.glsl")[1])
    safe = re.sub(r"<(?=[/!s])", r"\\u003c", prologue)  # the model's name in the JSON of its header
    return {"prologue": safe} | {name: glsl.read(name) for name in names} | {"shadertoy.glsl": main_template()}
