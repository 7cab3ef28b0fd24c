"""Program -> the generated part of every GLSL shader: field(), field_gradient(), albedo()."""

from dataclasses import dataclass

from ...model.errors import UserError
from ..ir.program import Array, Function, Program
from .cstyle import Language, Storage
from .literal import Literal
from .texels import Texture

STORAGES = ((64, "literal"), (4096, "texture"))
"""What `auto` takes up to which width. Literals up to 64 wide: 6 to 23 times faster than loops on software GL;
wider, their first draw takes minutes, and at 256 they crash SwiftShader."""

PLAIN = "0.80, 0.74, 0.66"
"""Albedo, sRGB, of a model without a texture."""


@dataclass(frozen=True, eq=False)
class Field:
    """Text of the field, its weight texture, and the loops of each call (see Shader)."""

    text: str
    weights: Array | None
    value_loops: tuple[int, ...]
    gradient_loops: tuple[int, ...]
    texture_loops: int


def print_field(program: Program, language: Language, storage: str) -> Field:
    """GLSL that defines, for p in model space and levels counted from 1:

    float field(vec3 p, int level, out int reached): value of the finest level up to `level` that is defined at p
    (Eq. 3), and which one it is; reads delta[];
    vec4 field_gradient(vec3 p, int level): grad f_level, f_level;
    vec3 albedo(vec3 p): colour, sRGB.

    Raises UserError where these cannot be stored so.
    """
    if storage == "packed":
        raise UserError("--storage packed: only shadertoy has it; there is literal, texture, auto")
    texture = Texture(program, language)
    stores: dict[str, Storage] = {"literal": Literal(program, language), "texture": texture}
    used = {function.name: stores[_choose(program, function, storage)] for function in program.functions()}
    lines: list[str] = []
    for store in stores.values():
        lines += store.declarations(tuple(f for f in program.functions() if used[f.name] is store))
    for function in program.functions():
        lines += ["", *used[function.name].function(function)]
    lines += ["", *_field(program, language), "", *_field_gradient(program, language), "", *_albedo(program, language)]

    def loops(functions: tuple[Function, ...]) -> tuple[int, ...]:
        each = [used[function.name].loops(function) for function in functions]
        return tuple(sum(each[:level]) for level in range(1, len(each) + 1))

    return Field(
        text="\n".join(lines) + "\n",
        weights=texture.image(),
        value_loops=loops(program.values),
        gradient_loops=loops(program.gradients),
        texture_loops=0 if program.texture is None else loops((program.texture,))[0],
    )


def _choose(program: Program, function: Function, storage: str) -> str:
    width = program.widest(function)
    return storage if storage != "auto" else next(name for limit, name in STORAGES if width <= limit)


def _input(program: Program) -> str:
    return f"vec4(p, {'time' if program.moving else '1.'})"


def _field(program: Program, language: Language) -> list[str]:
    lines = [
        language.begin("float", "field", f"vec3 p, int level, {language.out.format(name='reached')}"),
        f"    vec4 q = {_input(program)};",
        f"    float f = {program.values[0].name}(q);",
        "    reached = 1;",
    ]
    for i, function in enumerate(program.values[1:], start=1):
        lines.append(f"    if (reached == {i} && level > {i} && abs(f) < delta[{i - 1}]) {{")
        lines += [f"        f += {function.name}(q);", f"        reached = {i + 1};", "    }"]
    return [*lines, "    return f;", "}"]


def _field_gradient(program: Program, language: Language) -> list[str]:
    first, *others = [f"{function.name}(q)" for function in program.gradients]
    lines = [
        language.begin("vec4", "field_gradient", "vec3 p, int level"),
        f"    vec4 q = {_input(program)};",
        f"    vec4 g = {first};",
    ]
    lines += [f"    if (level > {i}) g += {call};" for i, call in enumerate(others, start=1)]
    return [*lines, "    return g;", "}"]


def _albedo(program: Program, language: Language) -> list[str]:
    value = f"vec3({PLAIN})" if program.texture is None else f"clamp({program.texture.name}({_input(program)}), 0., 1.)"
    return [language.begin("vec3", "albedo", "vec3 p"), f"    return {value};", "}"]
