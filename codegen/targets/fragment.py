"""The fragment shader of a model, for all GLSL targets. A `Dialect` holds the differences between them."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ... import glsl
from ...field.cells import Cells
from ...field.half_widths import Grid
from ...field.lowest import lowest_point
from ...ir.lower import lower
from ...ir.program import Array, Program
from ...model.model import Model
from ..printers.cstyle import Language
from ..printers.field import print_field
from .few_cells import few_cells
from .header import header_facts, header_line
from .narrow_bands import narrow_bands, print_bands
from .shader import FRAME, MASKED, Shader
from .uniforms import TIME, UNIFORMS, Uniform

FURTHER = 0.05
"""Most that a small grid of cells may add to a shader in one file, as a share of the text."""


@dataclass(frozen=True)
class Dialect:
    """The differences between two versions of GLSL."""

    target: str
    """Name of the target."""
    language: Language
    opening: tuple[str, ...]
    """First lines of the file."""
    uniform: str
    """Declaration of a uniform, a format with {type}, {name}, {default} and {meaning}."""
    advice: str
    """Advice for a user of the file, a comment after the header line."""
    helpers: str = ""
    """Text of functions that `language` names and GLSL does not have."""


def bake(
    model: Model,
    dialect: Dialect,
    storage: str,
    digits: int | None,
    main: str,
    passes: bool = False,
    traces: bool = True,
) -> Shader:
    """Make the fragment shader of a model.

    storage: "literal", "texture", "auto" or "mixed" (see `print_field`). digits: decimals of the weights; None for all.
    main: a file of glsl/ that follows the field, or GLSL text. passes: for a renderer that draws a frame in passes and
    binds a texture of cells. A shader in one file that `traces` rays has instead a small grid of cells and narrow bands
    as text, where these are short beside the rest. Raises UserError for the storage "packed", which only Shadertoy has.
    """
    program = lower(model, digits)
    # Beside literal values, a gradient in loops over texels costs more than the values that Newton's step saves.
    newton_first = passes and storage != "mixed" and program.composition is None
    field = print_field(program, dialect.language, storage, nested=newton_first)
    # With the gradients of the shading softbox as literals too, software GL compiles for a minute.
    soft = print_field(program, dialect.language, "mixed") if passes and field.weights is None else field
    shader = Shader(
        text="",
        weights=soft.weights,
        value_loops=field.value_loops,
        gradient_loops=soft.gradient_loops,
        texture_loops=soft.texture_loops,
        iterations=tuple(band.iterations for band in program.bands),
        deltas=tuple(band.delta for band in program.bands),
        textured=program.colored,
        moving=program.moving,
        ground=round(lowest_point(program), 4),
        cells=Cells(program) if passes else None,
        newton_first=newton_first,
    )
    facts = header_facts(model, program, dialect.target) | shader.facts()
    body = glsl.load(main) if main.endswith(".glsl") else main
    opening = prologue(facts, program, dialect, soft.weights, shader.ground)
    whole = replace(shader, text="\n".join([opening, field.text, body]))
    if not traces:
        return whole
    if not passes:
        length = len(with_weights(whole))
        if narrow := narrow_bands(program, length):
            opening = prologue(facts, program, dialect, soft.weights, shader.ground, narrow)
            field = print_field(program, dialect.language, storage, narrow=True)
        whole = replace(whole, text="\n".join([opening, field.text, body]), narrow=narrow)
        cells, few = few_cells(program, dialect.language, (1 + FURTHER) * length - len(with_weights(whole)))
        return replace(whole, text="\n".join([opening, field.text, cells + body]), few_cells=few)
    opening += "#define CELLS\n" + ("#define NEWTON\n" if newton_first else "")
    bodies = {name: glsl.load_numbered(f"{name}.glsl") for name in dict.fromkeys(FRAME.values())}
    texts = {name: "\n".join([opening, *[field.text] * (name in MASKED), bodies[name][0]]) for name in bodies}
    texts["floor"] = "\n".join([opening, soft.text, bodies["floor"][0]])
    texts["color"] = "\n".join([opening + "#define WITHOUT_SOFTBOX", field.text, bodies["color"][0]])
    texts["softbox"] = "\n".join([opening, soft.text, bodies["color"][0]])
    files = {name: bodies["color" if name == "softbox" else name][1] for name in texts}
    return replace(whole, passes={name: (text, files[name]) for name, text in texts.items()})


def prologue(
    facts: Mapping[str, Any],
    program: Program,
    dialect: Dialect,
    weights: Array | None,
    ground: float,
    narrow: tuple[Grid, ...] = (),
) -> str:
    """Return the text before the field: opening, header line with `facts`, uniforms, output, helpers, half_width().

    ground: height of the shape's lowest point, model space. narrow: from `narrow_bands`.
    """
    number = dialect.language.number
    arrays = {
        "iterations": f"int[]({', '.join(str(band.iterations) for band in program.bands)})",
    } | {
        name: f"float[]({', '.join(number(getattr(band, name)) for band in program.bands)})"
        for name in ("delta", "step_bound", "band_step_bound")
    }

    def declaration(uniform: Uniform) -> str:
        initial = uniform.glsl_default() or arrays[uniform.name]
        return dialect.uniform.format(
            type=uniform.type, name=uniform.declared, default=initial, meaning=uniform.meaning
        )

    uniforms = [declaration(uniform) for uniform in UNIFORMS]
    if program.moving:
        uniforms.append(declaration(TIME))
    if weights is not None:
        height, width, _ = weights.shape
        uniforms.append(f"uniform sampler2D weights; // {width} x {height} RGBA32F; see `weights` at the end")
    lines = [
        *dialect.opening,
        header_line(facts),
        f"// Multiscale neural signed distance function. Model space: the shape fits the unit sphere. {dialect.advice}",
        "",
        f"const int LEVELS = {len(program.bands)};",
        f"const float GROUND = {number(ground)}; // of the shape's lowest point",
        *uniforms,
        "out vec4 color;",
        "",
    ]
    return "\n".join(lines) + dialect.helpers + print_bands(narrow)


def with_weights(shader: Shader) -> str:
    """Return the shader as one file: comment lines in base64 at its end hold a weight texture."""
    return shader.text + ("" if shader.weights is None else _weights_comment(shader.weights))


def _weights_comment(weights: Array) -> str:
    data = base64.b64encode(weights.astype("<f4").tobytes()).decode()
    height, width, _ = weights.shape
    lines = [data[i : i + 116] for i in range(0, len(data), 116)]
    return f"\n// weights: {width} x {height} RGBA32F, little-endian float32, rows in order, base64:\n" + "".join(
        f"// {line}\n" for line in lines
    )
