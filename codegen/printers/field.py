"""Prints the generated part of every shader: field(), field_gradient() and albedo()."""

from dataclasses import dataclass
from itertools import accumulate

from ...ir.program import Array, Function, Program
from ...model.errors import UserError
from .cstyle import Language
from .literal import LiteralStorage
from .scene_loops import SceneLoops
from .texels import TexelLayout, TexelStorage

STORAGES = ((64, "literal"), (4096, "texture"))
"""(largest width, storage) of a network for the storage `auto`.

On software GL, literals up to 64 wide run 6 to 23 times faster than loops. Wider literals take minutes to compile, and
crash SwiftShader at 256.
"""

PLAIN = "0.80, 0.74, 0.66"
"""Color, sRGB, of a model without a texture; glsl/functions/base_color.glsl uses the same to hide a texture."""


def plain_color() -> tuple[float, float, float]:
    """Return PLAIN as numbers."""
    red, green, blue = map(float, PLAIN.split(","))
    return red, green, blue


@dataclass(frozen=True, eq=False)
class FieldText:
    """The printed field of a program."""

    text: str
    """Literal weights, the networks, and the three functions."""
    layout: TexelLayout
    """Weights in the texture."""
    value_loops: tuple[int, ...]
    """Upper bound of the loop iterations of field(p, level), at index level - 1."""
    gradient_loops: tuple[int, ...]
    """Upper bound of the loop iterations of field_gradient(p, level), at index level - 1."""
    texture_loops: int
    """Upper bound of the loop iterations of albedo(p)."""

    @property
    def weights(self) -> Array | None:
        """The weight texture, (H, W, 4) float32; None where all weights are literals."""
        return self.layout.image()


def print_field(
    program: Program, language: Language, storage: str, narrow: bool = False, nested: bool = False
) -> FieldText:
    """Print the three functions of the field, for p in model space and levels counted from 1.

    float field(vec3 p, int level, out int reached): value and number of the finest level up to `level` that is defined
    at p (Eq. 3). It reads delta[], or half_width() with `narrow` bands.
    vec4 field_gradient(vec3 p, int level): grad f_level, f_level.
    vec3 albedo(vec3 p): color, sRGB.
    With `nested`, also vec4 field_gradient(vec3 p, int level, out float f, out int reached): the results of field() in
    f and reached.

    storage: "literal", "texture", "auto" (each network by STORAGES), or "mixed": like "auto" for the levels' values,
    which a ray evaluates many times, and a texture for gradients and color, which it evaluates once. Raises UserError
    for "packed", which only Shadertoy has.
    """
    if storage == "packed":
        raise UserError("--storage packed: only target shadertoy takes it; choose literal, texture or auto")
    if program.composition is not None:
        return _print_scene(program, language, storage)
    functions = program.functions()
    chosen = {f.name: _choose(program, f, storage) for f in functions}
    literals = LiteralStorage(program, language, tuple(f for f in functions if chosen[f.name] == "literal"))
    texels = TexelStorage(program, language, tuple(f for f in functions if chosen[f.name] == "texture"))
    storage_of = {f.name: owner for owner in (literals, texels) for f in owner.functions}
    lines = [*literals.declarations(), *texels.declarations()]
    for function in functions:
        lines += ["", *storage_of[function.name].definition(function)]
    lines += ["", *_field(program, language, narrow), "", *_field_gradient(program, language, nested)]
    lines += ["", *_albedo(program, language)]

    def loops(of_levels: tuple[Function, ...]) -> tuple[int, ...]:
        """Return the loop iterations of each level, coarser levels included."""
        return tuple(accumulate(storage_of[function.name].loops(function) for function in of_levels))

    return FieldText(
        text="\n".join(lines) + "\n",
        layout=texels.layout,
        value_loops=loops(program.values),
        gradient_loops=loops(program.gradients),
        texture_loops=0 if program.texture is None else storage_of[program.texture.name].loops(program.texture),
    )


def _print_scene(program: Program, language: Language, storage: str) -> FieldText:
    """Print the field of a scene. Raises UserError for literal weights."""
    if storage == "literal":
        raise UserError("--storage literal: a scene keeps its weights in a texture; leave the option out")
    texels = TexelStorage(program, language, program.functions())
    printer = SceneLoops(program, language, texels.layout, PLAIN)
    value_loops, gradient_loops, texture_loops = printer.loops()
    lines = [*texels.declarations(), *printer.lines()]
    return FieldText("\n".join(lines) + "\n", texels.layout, value_loops, gradient_loops, texture_loops)


def _choose(program: Program, function: Function, storage: str) -> str:
    """Return the storage of a function's weights, "literal" or "texture"."""
    if storage in ("literal", "texture"):
        return storage
    if storage == "mixed" and function not in program.values:
        return "texture"
    width = program.widest(function)
    return next(name for limit, name in STORAGES if width <= limit)


def _input(program: Program) -> str:
    """Return the networks' input at a point `p`."""
    return f"vec4(p, {'time' if program.moving else '1.'})"


def _field(program: Program, language: Language, narrow: bool) -> list[str]:
    """Return field() (Eq. 3)."""
    lines = [
        language.begin("float", "field", f"vec3 p, int level, {language.out.format(type='int', name='reached')}"),
        f"    vec4 q = {_input(program)};",
        f"    float f = {program.values[0].name}(q);",
        "    reached = 1;",
    ]
    for i, function in enumerate(program.values[1:], start=1):
        width = f"half_width(p, {i})" if narrow else f"delta[{i - 1}]"
        lines.append(f"    if (reached == {i} && level > {i} && abs(f) < {width}) {{")
        lines += [f"        f += {function.name}(q);", f"        reached = {i + 1};", "    }"]
    return [*lines, "    return f;", "}"]


def _field_gradient(program: Program, language: Language, nested: bool) -> list[str]:
    """Return field_gradient(), with `nested` also the overload that outputs f and reached."""
    first, *others = [f"{function.name}(q)" for function in program.gradients]
    outputs = f", out float f, {language.out.format(type='int', name='reached')}" if nested else ""
    lines = [
        language.begin("vec4", "field_gradient", "vec3 p, int level" + outputs),
        f"    vec4 q = {_input(program)};",
        f"    vec4 g = {first};",
    ]
    if nested:
        lines += ["    f = g.w;", "    reached = 1;"]
    for i, call in enumerate(others, start=1):
        lines.append(f"    if (level > {i}) g += {call};")
        if nested:
            lines.append(f"    if (reached == {i} && level > {i} && abs(f) < delta[{i - 1}]) {{")
            lines += ["        f = g.w;", f"        reached = {i + 1};", "    }"]
    lines += ["    return g;", "}"]
    if nested:
        lines += ["", language.begin("vec4", "field_gradient", "vec3 p, int level"), "    float f;", "    int reached;"]
        lines += ["    return field_gradient(p, level, f, reached);", "}"]
    return lines


def _albedo(program: Program, language: Language) -> list[str]:
    value = f"vec3({PLAIN})" if program.texture is None else f"clamp({program.texture.name}({_input(program)}), 0., 1.)"
    return [language.begin("vec3", "albedo", "vec3 p"), f"    return {value};", "}"]
