"""Target python: the distance function alone for NumPy, with its normal and colour, in one file without mplicits."""

import json
from collections.abc import Iterator, Mapping

import numpy as np

from ...ir.prefixed import prefixed
from ...ir.program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed
from ...model.model import Model
from ...model.orientation import UPRIGHT
from ..printers.cstyle import constants_of
from ..printers.field import PLAIN, plain_colour
from ..printers.scene_leaf import Triple
from ..printers.unrolled import Unrolled
from ..printers.user_functions import Place
from .function_target import described, prepared
from .header import header_facts

WIDTH = 110
"""Characters of a line of weights."""


def standalone(
    model: Model, storage: str = "auto", digits: int | None = None, name: str | None = None, space: str = "model"
) -> str:
    """Return the functions of a model, whose names begin with `name` (None: made of the model's), in a space."""
    program, called, place = prepared(model, storage, digits, name, space)
    facts = header_facts(model, program, "python") | {"function": called, "space": space}
    program = prefixed(program, f"_{called}")
    lines = [f"# {json.dumps(facts)}", *(f"# {line}" for line in described(program, called, space))]
    lines += ["# p: points (..., 3). The results have the shapes (...) and (..., 3).", "", "import numpy as np", ""]
    for constant in constants_of(program.functions()):
        lines += _constant(constant, program.constants[constant])
    for function in program.functions():
        lines += ["", "", f"def {function.name}({INPUT}):"]
        lines += [f"    {op.result} = {_expression(op)}" for op in function.ops]
        lines.append(f"    return {', '.join(function.outputs)}")
    return "\n".join([*lines, *_face(program, called, place)]) + "\n"


class _Notation:
    """How NumPy writes the numbers of a scene. asking: name of the function that `_helper` prints."""

    both, pick = "{0} & {1}", "np.where({condition}, {yes}, {no})"
    let = holds = "{name} = {value}"
    functions: Mapping[str, str] = {name: f"np.{name}({{0}})" for name in ("sqrt", "sin", "cos", "abs")} | {
        "min": "np.minimum({0}, {1})",
        "max": "np.maximum({0}, {1})",
    }

    def __init__(self, asking: str) -> None:
        self._asking = asking

    def number(self, value: float) -> str:
        """Return a literal."""
        return repr(float(value))

    def ask(self, name: str, function: Function, inputs: tuple[str, str, str, str], condition: str) -> list[str]:
        """Return the line that calls a function where a condition holds."""
        return [f"{name} = {self._asking}({function.name}, {condition}, {', '.join(inputs)})"]

    def output(self, name: str, _: Function, k: int) -> str:
        """Return an element."""
        return f"{name}[{k}]"


def _constant(name: str, values: Array) -> Iterator[str]:
    """Yield an array of weights."""
    shape = "" if values.ndim == 1 else f".reshape({values.shape[0]}, {values.shape[1]})"
    yield f"{name} = np.array(["
    line = "   "
    for value in values.ravel():
        text = f" {_number(float(value))},"
        if len(line) + len(text) > WIDTH:
            yield line
            line = "   "
        line += text
    yield line
    yield f"], np.float32){shape}"


def _number(value: float) -> str:
    """Return the shortest literal that reads back as the same float32."""
    return str(np.float32(value))


def _expression(op: Op) -> str:
    """Return what computes an op's result (N, width), or (N,) of a Dot."""
    match op:
        case Affine(source=source, matrix=matrix, bias=bias):
            text = f"{source} @ {matrix}.T{f' + {bias}' if bias else ''}"
        case Transposed(source=source, matrix=matrix):
            text = f"{source} @ {matrix}"
        case Sine(source=source):
            text = f"np.sin({source})"
        case Cosine(source=source):
            text = f"np.cos({source})"
        case Product(left=left, right=right):
            text = f"{left} * {right}"
        case Dot(source=source, row=row, scale=scale, bias=bias):
            text = f"np.float32({_number(scale)}) * ({source} @ {row}) + np.float32({_number(bias)})"
        case Scale(source=source, factor=factor):
            text = f"np.float32({_number(factor)}) * {source}"
    return text


def _face(program: Program, name: str, place: Place) -> list[str]:
    """Return the functions that users call."""
    centre, scale, up = place
    time = ", time" if program.moving else ""
    turned = [list(map(int, row)) for row in UPRIGHT[up]]
    level, normal, colour = (_of_scene if program.composition else _of_shape)(program, name, time)
    return [
        *("", "", f"def _{name}_input(p{time}):"),
        f"    p = np.asarray(p, np.float64).reshape(-1, 3) @ np.array({turned}).T",
        f"    p = (p - {list(map(float, centre))}) / {float(scale)}",
        f"    fourth = np.full((len(p), 1), {'time' if program.moving else '1.0'})",
        "    return np.concatenate([p, fourth], axis=1).astype(np.float32)",
        *(_helper(name) if program.composition else []),
        *("", "", f"def {name}_level(p, level{time}):"),
        f"    q = _{name}_input(p{time})",
        *level,
        f"    return total.reshape(np.shape(p)[:-1]) * np.float32({float(scale)})",
        *("", "", f"def {name}(p{time}):"),
        f"    return {name}_level(p, {len(program.bands)}{time})",
        *("", "", f"def {name}_normal(p{time}):"),
        f"    q = _{name}_input(p{time})",
        *normal,
        "    normal = total[:, :3] / np.linalg.norm(total[:, :3], axis=1, keepdims=True)",
        f"    return (normal @ np.array({turned}, np.float32)).reshape(np.shape(p))",
        *("", "", f"def {name}_color(p{time}):"),
        *colour,
    ]


def _of_shape(program: Program, name: str, time: str) -> tuple[list[str], list[str], list[str]]:
    """Return the lines that compute, at q, `total`, first the field and then its gradient, and those of the colour."""
    deltas = [band.delta for band in program.bands[:-1]]
    values = ", ".join(function.name for function in program.values)
    gradients = ", ".join(function.name for function in program.gradients)
    level = [
        f"    total = {program.values[0].name}(q)",
        "    rows, f = np.arange(len(q)), total",
        f"    for network, delta in zip([{values}][1:level], {deltas}):",
        "        inside = np.abs(f) < delta",
        "        rows = rows[inside]",
        "        f = f[inside] + network(q[rows])",
        "        total[rows] = f",
    ]
    gradient = [
        f"    total, f = {program.gradients[0].name}(q)",
        "    rows = np.arange(len(q))",
        f"    for network, delta in zip([{gradients}][1:], {deltas}):",
        "        inside = np.abs(f) < delta",
        "        rows = rows[inside]",
        "        gradient, residual = network(q[rows])",
        "        f = f[inside] + residual",
        "        total[rows] += gradient",
    ]
    if program.texture is None:
        return level, gradient, [f"    return np.full(np.shape(p), [{PLAIN}], np.float32)"]
    colour = [
        f"    color = np.stack({program.texture.name}(_{name}_input(p{time})), axis=1)",
        "    return np.clip(color, 0, 1).reshape(np.shape(p))",
    ]
    return level, gradient, colour


def _of_scene(program: Program, name: str, time: str) -> tuple[list[str], list[str], list[str]]:
    """Return the same for a scene."""

    def there(level: str | None = None) -> Unrolled:
        return Unrolled(program, _Notation(f"_{name}_ask"), ("x", "y", "z"), level=level)

    point = "    x, y, z = q[:, :3].astype(np.float64).T"
    value, gradient, colour = there("level"), there(), there()
    slope, shade = gradient.gradient(), colour.colour(plain_colour())

    def stacked(what: Unrolled, numbers: Triple) -> str:
        return f"np.stack(np.broadcast_arrays({', '.join(map(what.text, numbers))}), axis=1).astype(np.float32)"

    return (
        [point, *_indented(value.lines(value.value)), f"    total = {value.text(value.value)}.astype(np.float32)"],
        [point, *_indented(gradient.lines(*slope)), f"    total = {stacked(gradient, slope)}"],
        [
            f"    q = _{name}_input(p{time})",
            point,
            *_indented(colour.lines(*shade)),
            f"    return {stacked(colour, shade)}.reshape(np.shape(p))",
        ],
    )


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _helper(name: str) -> list[str]:
    """Return the function that asks a network where a condition holds."""
    return [
        *("", "", f"def _{name}_ask(network, where, *inputs):"),
        "    q = np.stack(np.broadcast_arrays(*inputs), axis=1).astype(np.float32)",
        "    results = network(q[where])",
        "    columns = results if isinstance(results, tuple) else (results,)",
        "    if columns[0].ndim == 2:",
        "        columns = (*columns[0].T[:3], columns[1])",
        "    outputs = np.zeros((len(columns), len(q)))",
        "    outputs[:, where] = columns",
        "    return outputs",
    ]
