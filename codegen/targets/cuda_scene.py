"""The field of a scene in CUDA: its networks read the array of weights, and the composition is printed as scalars."""

from ...ir.program import Program
from ..printers.cstyle import Language
from ..printers.field import plain_colour
from ..printers.scalars import Number, Scalar, VectorNotation
from ..printers.texels import TexelLayout, TexelStorage
from ..printers.unrolled import Unrolled


def scene_field(program: Program, language: Language) -> tuple[str, TexelLayout]:
    """Return the text of the functions that `print_field` gives for a shape, and the layout of the weights."""
    storage = TexelStorage(program, language, program.functions())
    lines = storage.declarations()
    for function in program.functions():
        lines += ["", *storage.definition(function)]
    deltas = tuple(Scalar(f"delta[{k}]") for k in range(len(program.bands)))

    def there(level: str | None = "level") -> Unrolled:
        return Unrolled(program, VectorNotation(language), ("p.x", "p.y", "p.z"), level=level, deltas=deltas)

    field, slope, painted = there(), there(), there(None)
    gradient, colour = slope.gradient(), painted.colour(plain_colour())
    out = language.out.format(name="reached")
    lines += [
        language.begin("float", "field", f"vec3 p, int level, {out}"),
        *_indented(field.lines(field.value, field.reached)),
        f"    reached = static_cast<int>({field.text(field.reached)});",
        f"    return {field.text(field.value)};",
        "}",
        language.begin("vec4", "field_gradient", "vec3 p, int level"),
        *_indented(slope.lines(*gradient, slope.value)),
        f"    return {_vector(slope, 'vec4', (*gradient, slope.value))};",
        "}",
        language.begin("vec3", "albedo", "vec3 p"),
        *_indented(painted.lines(*colour)),
        f"    return {_vector(painted, 'vec3', colour)};",
        "}",
    ]
    return "\n".join(lines) + "\n", storage.layout


def _vector(there: Unrolled, kind: str, numbers: tuple[Number, ...]) -> str:
    return f"{kind}({', '.join(map(there.text, numbers))})"


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]
