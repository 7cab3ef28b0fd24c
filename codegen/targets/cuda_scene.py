"""The field of a scene in CUDA: the networks read the array of weights, and the scene is printed as scalars."""

from ...ir.program import Program
from ..printers.cstyle import Language
from ..printers.field import plain_color
from ..printers.scalars import Number, Scalar, VectorNotation, Writer
from ..printers.scene_scalars import SceneAtPoint
from ..printers.texels import TexelLayout, TexelStorage


def scene_field(program: Program, language: Language) -> tuple[str, TexelLayout]:
    """Return the functions that `print_field` prints for a shape, and the layout of the weights."""
    storage = TexelStorage(program, language, program.functions())
    lines = storage.declarations()
    for network in program.functions():
        lines += ["", *storage.definition(network)]
    deltas = tuple(Scalar(f"delta[{k}]") for k in range(len(program.bands)))
    point = Scalar("p.x"), Scalar("p.y"), Scalar("p.z")

    def function(kind: str, head: str, quantity: str, level: str | None = "level") -> list[str]:
        writer = Writer(VectorNotation(language))
        field = SceneAtPoint(program, writer, point, level, deltas)
        results: tuple[Number, ...]
        if quantity == "field":
            results = field.value, field.reached
        elif quantity == "field_gradient":
            results = *field.gradient(), field.value
        else:
            results = field.color(plain_color())
        texts = [writer.text(result) for result in results]
        body = [f"    {line}" for line in writer.lines(*results)]
        if quantity == "field":
            body.append(f"    reached = static_cast<int>({texts.pop()});")
        return [language.begin(kind, quantity, head), *body, f"    return {kind}({', '.join(texts)});", "}"]

    out = language.out.format(type="int", name="reached")
    lines += function("float", f"vec3 p, int level, {out}", "field")
    lines += function("vec4", "vec3 p, int level", "field_gradient")
    lines += function("vec3", "vec3 p", "albedo", level=None)
    return "\n".join(lines) + "\n", storage.layout
