"""Target html: one page that shows the model offline. Its style and HTML are in view/."""

import base64
import io
import math
import re
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import glsl
from ..codegen.printers.field import PLAIN, STORAGES, print_field
from ..codegen.targets import fragment, orbit
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
from ..model import page_style
from ..model.errors import UserError
from ..model.model import Model
from ..model.model_file import to_bytes
from ..model.version import installed_version
from .about import about
from .bundle import modules, read, script
from .facts import PAGE_PASSES, facts_json
from .scene import scene_facts, texel_bytes
from .short_weights import page_weights, short_weights

ENTRY = "page.js"
"""The module that opens the page, with all that it imports."""
POSTER_SIDE = 160
"""Pixels along each side of the picture that the page shows before its first frame."""
POSTER_QUALITY = 50
"""Quality of its WebP, from 0 to 100."""
NO_PICTURE = "data:,"
"""URL in the place of a poster."""
SHADERS = ("anywhere", *PAGE_PASSES, "accumulate", "present", "blocks.vert", "contrast", "scatter", "scatter.vert")
"""Files in glsl/ with the shaders of the page."""
PROBES = 8
"""Largest number of points at which the page checks its field."""

_PLACE = re.compile(r"\{\{(\w+)\}\}")
"""A placeholder in page.html or page.css."""
_CONTROL = re.compile(r"[\x00-\x1f]")
"""Characters that a title does not hold: packed_page.py uses two of them as marks."""
DESCRIPTION = "A shape as a neural network: drag to turn it."
PALETTES = {"dark": page_style.variables(page_style.DARK), "light": page_style.variables(page_style.LIGHT)}


@dataclass(frozen=True)
class Extension:
    """Additions of another room to the page of a model."""

    scripts: str = ""
    """JavaScript ahead of page.js, in the scope of the page's modules."""
    stage: str = ""
    """HTML over the picture."""
    css: str = ""
    elements: str = ""
    """Further elements with data."""
    facts: dict[str, Any] = field(default_factory=dict)
    """Further keys of `facts` (model/facts.js)."""
    policy: str = ""
    """Further sources and directives of the Content-Security-Policy, after script-src."""
    accept: str = ".safetensors"
    """Endings of files to open."""
    open: str = "Open model"
    hint: str = "Drop a .safetensors model anywhere."
    description: str = DESCRIPTION


def standalone(
    model: Model,
    storage: str = "auto",
    digits: int | None = None,
    poster: bool = True,
    shade: str = OPENING_SHADES[0],
    extension: Extension | None = None,
    short: bool = False,
    address: str = "",
    preview: str = "",
) -> str:
    """Return the text of the page.

    storage: "texture" stores the weights in a texture. "auto" also compiles them as literals, for networks up to 64
    wide, and keeps the faster variant; "literal" does so for wider networks too. digits: decimals of the weights, None
    for exact weights. poster: include a small picture of the model, which takes seconds to draw. shade: initial
    shading, one of OPENING_SHADES. extension: additions to the page. short: store weights as short whole numbers where
    that keeps the field (short_weights.py). 16-bit floats are stored as such. address, preview: see `about`. Raises
    UserError for another storage.
    """
    chosen = page_weights(model, digits, short_weights if short else None)
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
    facts = header | {"ground": ground} | _facts(program, storage)
    if model.scene is not None:
        facts["scene"] = scene_facts(model, program, text)
        data = texel_bytes(text)
    else:
        data = chosen.data or model_bytes(weights)
    picture = poster_url(model, shade) if poster else NO_PICTURE
    return _page(model.name, facts, data, prologue, picture, shade, extension, (address, preview))


def without_model(name: str, shade: str = OPENING_SHADES[0], extension: Extension | None = None) -> str:
    """Return the text of a page that shows no model until a file is dropped.

    name: the page's title. shade, extension: see `standalone`.
    """
    facts = {"mplicits": installed_version(), "target": "html", "name": name}
    program = Program(name, "", (), (), (), None, {}, moving=True)
    prologue = fragment.prologue(facts, program, DIALECT, np.zeros((1, 1, 4), np.float32), 0.0)
    return _page(name, facts, b"", prologue, NO_PICTURE, shade, extension)


def _page(
    name: str,
    facts: dict[str, Any],
    data: bytes,
    prologue: str,
    poster: str,
    shade: str,
    extension: Extension | None,
    links: tuple[str, str] = ("", ""),
) -> str:
    """Fill page.html. data: the model's weights; empty without a model. poster: a URL. links: see `about`."""
    more = extension or Extension()
    marked = {key: f"/*studio*/{text}/*end*/\n" if (text := getattr(more, key)) else "" for key in ("scripts", "css")}
    parts = {
        "about": about(_CONTROL.sub("", name), more.description, *links),
        "state": "" if data else ' data-state="empty"',
        "css": _PLACE.sub(lambda match: PALETTES[match[1]], read("view/page.css")) + marked["css"],
        "poster": poster,
        "unseen": " hidden" if poster == NO_PICTURE else "",
        "js": script(modules(ENTRY)[:-1]) + marked["scripts"] + script((ENTRY,)),
        "facts": facts_json(facts | {"shade": shade} | more.facts),
        "weights": _wrapped(base64.b64encode(data).decode()),
        "prologue": _shader(prologue),
        "glsl": _glsl(),
        **{
            key: f"<!--studio-->{text}<!--end-->\n" if (text := getattr(more, key)) else ""
            for key in ("stage", "elements")
        },
        **{key: getattr(more, key) for key in ("policy", "accept", "open", "hint")},
    }
    return _PLACE.sub(lambda match: parts[match[1]], read("view/page.html"))


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

    shade: one of OPENING_SHADES; the studio has no floor here.
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


def _shader(text: str) -> str:
    """Escape GLSL for a script element: only the model's name, in the header's JSON, can hold a tag."""
    return re.sub(r"<(?=[/!s])", r"\\u003c", text)


def _glsl() -> str:
    """Return the files in glsl/ of SHADERS, and Shadertoy's template, each in a script element with its name as id."""
    names = dict.fromkeys(name for shader in SHADERS for name in glsl.load_numbered(f"{shader}.glsl")[1])
    return "\n".join([*(_shader_element(name, glsl.read(name)) for name in names), shadertoy_element()])


def shadertoy_element() -> str:
    """Return the script element that print/shadertoy.js needs, the template of its text."""
    return _shader_element("shadertoy.glsl", main_template())


def _shader_element(name: str, text: str) -> str:
    return f'<script type="x-shader/x-fragment" id="{name}">{_shader(text)}</script>'


def _wrapped(text: str) -> str:
    return "\n".join(text[i : i + 120] for i in range(0, len(text), 120))
