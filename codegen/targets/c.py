"""Target c: the distance function alone in C99, with its normal and colour, and no library but the standard's."""

from collections.abc import Iterable, Iterator, Mapping

from ...ir.prefixed import prefixed
from ...ir.program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed
from ...model.model import Model
from ...model.orientation import UPRIGHT
from ..printers.cstyle import Language, constants_of
from ..printers.field import plain_colour
from ..printers.unrolled import Unrolled
from ..printers.user_functions import Place
from .function_target import described, prepared
from .header import header_facts, header_line

LANGUAGE = Language(suffix="f")
PER_LINE = 8
"""Numbers in a line of weights."""


def standalone(
    model: Model, storage: str = "auto", digits: int | None = None, name: str | None = None, space: str = "model"
) -> str:
    """Return the functions of a model, whose names begin with `name` (None: made of the model's), in a space."""
    program, called, place = prepared(model, storage, digits, name, space)
    facts = header_facts(model, program, "c") | {"function": called, "space": space}
    program = prefixed(program, called)
    lines = [header_line(facts), *(f"// {line}" for line in described(program, called, space))]
    lines += ["// p, the normal and the colour are three floats. Link with -lm.", "", "#include <math.h>", ""]
    for constant in constants_of(program.functions()):
        lines += _constant(constant, program.constants[constant])
    for function in program.functions():
        lines += ["", *_function(program, function)]
    return "\n".join([*lines, *_face(program, called, place)]) + "\n"


class _Notation:
    """How C writes the numbers of a scene."""

    both, pick = "{0} && {1}", "({condition} ? {yes} : {no})"
    let, holds = "float {name} = {value};", "int {name} = {value};"
    functions: Mapping[str, str] = {name: f"{name}f({{0}})" for name in ("sqrt", "sin", "cos")} | {
        "abs": "fabsf({0})",
        "min": "fminf({0}, {1})",
        "max": "fmaxf({0}, {1})",
    }

    def number(self, value: float) -> str:
        """Return a literal."""
        return _number(value)

    def ask(self, name: str, function: Function, inputs: tuple[str, str, str, str], condition: str) -> list[str]:
        """Return lines that call a function where a condition holds."""
        count = {1: 1, 2: 4, 3: 3}[len(function.outputs)]
        call = f"const float at[4] = {{{', '.join(inputs)}}}; {function.name}(at, {name});"
        return [f"float {name}[{count}] = {{0.f}};", f"if ({condition}) {{ {call} }}"]

    def output(self, name: str, _: Function, k: int) -> str:
        """Return an element."""
        return f"{name}[{k}]"


def _number(value: float) -> str:
    return LANGUAGE.number(value)


def _constant(name: str, values: Array) -> Iterator[str]:
    """Yield an array: [rows][columns], or [n]."""
    yield f"static const float {name}{''.join(f'[{size}]' for size in values.shape)} = {{"
    for row in values.reshape(-1, values.shape[-1]):
        numbers = [_number(value) for value in row]
        lines = [", ".join(numbers[i : i + PER_LINE]) for i in range(0, len(numbers), PER_LINE)]
        text = ",\n     ".join(lines)
        yield f"    {{{text}}}," if values.ndim == 2 else f"     {text}"
    yield "};"


def _function(program: Program, function: Function) -> list[str]:
    """Return a function of the program: it takes its input and writes its outputs one after the other."""
    widths = program.widths(function)
    lines = [f"static void {function.name}(const float {INPUT}[4], float out[])", "{"]
    for op in function.ops:
        lines.append(f"    float {op.result}[{widths[op.result]}];")
        lines += [f"    {line}" for line in _statement(op, widths)]
    k = 0
    for output in function.outputs:
        count = 3 if output == "gradient" else widths[output]
        lines += [f"    out[{k + i}] = {output}[{i}];" for i in range(count)]
        k += count
    return [*lines, "}"]


def _statement(op: Op, widths: dict[str, int]) -> list[str]:
    """Return the lines that compute an op's result."""
    result, width = op.result, widths[op.result]
    each = f"for (int o = 0; o < {width}; o++)"
    match op:
        case Affine(source=source, matrix=matrix, bias=bias):
            start, term = f"{bias}[o]" if bias else "0.f", f"{matrix}[o][i] * {source}[i]"
        case Transposed(source=source, matrix=matrix):
            start, term = "0.f", f"{matrix}[i][o] * {source}[i]"
        case Dot(source=source, row=row, scale=scale, bias=bias):
            sum_ = f"for (int i = 0; i < {widths[source]}; i++) {result}[0] += {row}[i] * {source}[i];"
            end = f"{result}[0] = {_number(scale)} * {result}[0] + {_number(bias)};"
            return [f"{result}[0] = 0.f;", sum_, end]
        case Sine(source=source):
            return [f"{each} {result}[o] = sinf({source}[o]);"]
        case Cosine(source=source):
            return [f"{each} {result}[o] = cosf({source}[o]);"]
        case Product(left=left, right=right):
            return [f"{each} {result}[o] = {left}[o] * {right}[o];"]
        case Scale(source=source, factor=factor):
            return [f"{each} {result}[o] = {_number(factor)} * {source}[o];"]
    count = widths[source]
    loop = f"    for (int i = 0; i < {count}; i++) {result}[o] += {term};"
    return [f"{each} {{", f"    {result}[o] = {start};", loop, "}"]


def _face(program: Program, name: str, place: Place) -> list[str]:
    """Return the functions that users call."""
    centre, scale, up = place
    time, passed = (", float time", ", time") if program.moving else ("", "")
    lines = ["", f"static void {name}_input(const float p[3]{time}, float q[4])", "{"]
    for k, (row, offset) in enumerate(zip(UPRIGHT[up], centre, strict=True)):
        text = _component(row, "p")
        moved = f"({text} - {_number(offset)})" if offset else text
        lines.append(f"    q[{k}] = {moved}{f' * {_number(1 / scale)}' if scale != 1 else ''};")
    lines += [f"    q[3] = {'time' if program.moving else '1.f'};", "}", ""]
    level, gradient, colour = (_of_scene if program.composition else _of_shape)(program, name, passed)
    lines += [f"float {name}_level(const float p[3], int level{time})", "{", "    float q[4];"]
    lines += [f"    {name}_input(p{passed}, q);", *level]
    lines += ["    (void)level;", f"    return f{f' * {_number(scale)}' if scale != 1 else ''};", "}", ""]
    lines += [f"float {name}(const float p[3]{time})", "{"]
    lines += [f"    return {name}_level(p, {len(program.bands)}{passed});", "}", ""]
    lines += [f"void {name}_normal(const float p[3]{time}, float normal[3])", "{"]
    lines += ["    float q[4], length;", f"    {name}_input(p{passed}, q);", *gradient]
    lines.append("    length = sqrtf(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);")
    back = [_component(column, "g") for column in zip(*UPRIGHT[up], strict=True)]
    lines += [f"    normal[{k}] = {text} / length;" for k, text in enumerate(back)]
    lines += ["}", "", f"void {name}_color(const float p[3]{time}, float color[3])", "{"]
    return [*lines, "    float q[4];", f"    {name}_input(p{passed}, q);", *colour, "}"]


def _of_shape(program: Program, *_: str) -> tuple[list[str], list[str], list[str]]:
    """Return the lines that compute, at q, the value f up to `level`, the gradient g, and the colour."""
    level = ["    float f, r;", f"    {program.values[0].name}(q, &f);", "    r = f;"]
    for i, function in enumerate(program.values[1:], start=1):
        inside = f"fabsf(f) < {_number(program.bands[i - 1].delta)}"
        level += [f"{'    ' * i}if (level > {i} && {inside}) {{"]
        level += [f"{'    ' * i}    {function.name}(q, &r);", f"{'    ' * i}    f += r;"]
    level += ["    " * i + "}" for i in range(len(program.values) - 1, 0, -1)]
    gradient = ["    float g[4], r[4];", f"    {program.gradients[0].name}(q, g);", "    r[0] = 0.f;", "    (void)r;"]
    for i, function in enumerate(program.gradients[1:], start=1):
        gradient.append(f"{'    ' * i}if (fabsf(g[3]) < {_number(program.bands[i - 1].delta)}) {{")
        gradient += [f"{'    ' * i}    {function.name}(q, r);"]
        gradient += [f"{'    ' * i}    for (int k = 0; k < 4; k++) g[k] += r[k];"]
    gradient += ["    " * i + "}" for i in range(len(program.gradients) - 1, 0, -1)]
    if program.texture is None:
        plain = ["    (void)q;", *_assigned("color", map(_number, plain_colour()))]
        return [*level, "    (void)r;"], gradient, plain
    clamped = "    for (int k = 0; k < 3; k++) color[k] = fminf(fmaxf(color[k], 0.f), 1.f);"
    return [*level, "    (void)r;"], gradient, [f"    {program.texture.name}(q, color);", clamped]


def _of_scene(program: Program, _: str, passed: str) -> tuple[list[str], list[str], list[str]]:
    """Return the same for a scene."""

    def there(level: str | None = None) -> Unrolled:
        return Unrolled(program, _Notation(), ("q[0]", "q[1]", "q[2]"), level=level)

    value, gradient, colour = there("level"), there(), there()
    slope, shade = gradient.gradient(), colour.colour(plain_colour())
    unused = ["    (void)time;"] if passed else []
    return (
        [*unused, *_indented(value.lines(value.value)), f"    float f = {value.text(value.value)};"],
        [*unused, "    float g[3];", *_indented(gradient.lines(*slope)), *_assigned("g", map(gradient.text, slope))],
        [*unused, *_indented(colour.lines(*shade)), *_assigned("color", map(colour.text, shade))],
    )


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _assigned(name: str, values: Iterable[str]) -> list[str]:
    """Return the lines that fill an array."""
    return [f"    {name}[{k}] = {value};" for k, value in enumerate(values)]


def _component(row: tuple[float, ...], vector: str) -> str:
    """Return the component that a row of a rotation by right angles takes from a vector: `-p[1]` for (0, -1, 0)."""
    (k,) = (k for k, value in enumerate(row) if value)
    return f"{'-' if row[k] < 0 else ''}{vector}[{k}]"
