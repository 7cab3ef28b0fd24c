"""Prints weights of few bits (model/quantize.py), several in each integer, for a short text.

A layer's weights are multiples of one step, from -h to h. With h added, they are digits of base B = 2 h + 1. An ivec4
holds the four columns of a mat4: each of its numbers has one digit for each column. Where four digits do not fit 31
bits, two ivec4 hold two columns each. Macros unpack them in constant expressions, which compilers fold into literals:

- L(B, S) opens a layer with base and step. A layer computes y[0], y[1], ... from the vec4 x[0], x[1], ...;
- D(v, k) is the digit with place value k of each number of the ivec4 v, as a vec4 of multiples of the step;
- M(v) and N(v, w) are the mat4 of one ivec4 and of two;
- R0, R1, ... compute one vec4 of a layer: one macro for each width and number of digits;
- E(i, ..) is the part of x[i] and x[i + 1] in an output.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from string import ascii_lowercase

import numpy as np
from numpy.typing import NDArray

from ...ir.program import INPUT, Affine, Array, Dot, Function, Program, Sine
from ...model.quantize import are_multiples, step_of
from .cstyle import Language, Storage

LARGEST = 2047
"""Largest multiple of its step that a weight can be."""
LIMIT = 1 << 31
"""Every integer in the text is smaller."""
MACROS = """\
#define D(v,k)vec4(v/(k)%ivec4(B)-B/2)
#define L(b,s){const int B=b;const float S=s;
#define M(v)mat4(D(v,1),D(v,B),D(v,B*B),D(v,B*B*B))
#define N(v,w)mat4(D(v,1),D(v,B),D(w,1),D(w,B))
#define E(i,a,b,c,d)dot(D(ivec4(a,b,c,d),1),x[i])+dot(D(ivec4(a,b,c,d),B),x[i+1])"""
"""The macros without R0, R1, ..."""

Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class WholeLayer:
    """One layer as integers."""

    weights: Whole
    """(rows, columns) multiples of the step."""
    bias: Whole
    """(rows,) multiples of the step; empty in the first layer, whose bias is a matrix column."""
    base: int
    """Base of the digits, odd."""
    step: float
    """The step."""
    inputs: tuple[float, ...]
    """Factors of the input's components, for the first layer; empty for others."""

    @property
    def shape(self) -> tuple[int, int, bool]:
        """Parameters of the layer's macro: width of its input, digits in a number, and whether it adds a bias."""
        return self.weights.shape[1], 4 if self.base**4 <= LIMIT else 2, bool(len(self.bias))


class PackedStorage(Storage):
    """Weights as packed integers, only for functions that compute values."""

    def __init__(self, program: Program, language: Language, functions: tuple[Function, ...]) -> None:
        super().__init__(program, language, functions)
        ops = [op for function in functions for op in function.ops if isinstance(op, Affine)]
        self._layers = {op.matrix: whole_layer(program, op) for op in ops}
        shapes = dict.fromkeys(layer.shape for layer in self._layers.values())
        self._macros = {shape: f"R{k}" for k, shape in enumerate(shapes)}

    def declarations(self) -> list[str]:
        """Return the macros."""
        rows = [_row_macro(name, *shape) for shape, name in self._macros.items()]
        return [*MACROS.splitlines(), *rows] if self.functions else []

    def statements(self, function: Function) -> Iterator[str]:
        """Yield a layer's lines for each Affine with its Sine, and an output's line for each Dot.

        Raises ValueError for other ops, and for weights that are not multiples of a step.
        """
        blocks = max(self.program.widths(function).values()) // 4
        yield f"vec4[{blocks}] x,y;"
        outputs = [op for op in function.ops if isinstance(op, Dot)]
        base = 2 * max(multiples(self.program.constants[op.row])[1] for op in outputs) + 1
        for op, after in zip(function.ops, (*function.ops[1:], None), strict=True):
            match op, after:
                case Affine(matrix=matrix), Sine():
                    yield from self._layer(self._layers[matrix])
                case Sine(), _:
                    pass
                case Dot(), _:
                    if op is outputs[0]:
                        yield f"const int B={base};"
                    yield self._output(op, base)
                case _:
                    raise ValueError(f"{type(op).__name__} cannot be packed")

    def _layer(self, layer: WholeLayer) -> Iterator[str]:
        number, name = self.language.number, self._macros[layer.shape]
        if layer.inputs:
            yield f"x[0]=p*vec4({','.join(map(number, layer.inputs))});"
        yield f"L({layer.base},{number(layer.step)})"
        for o in range(len(layer.weights) // 4):
            rows = slice(4 * o, 4 * o + 4)
            numbers = [*layer.bias[rows].tolist(), *_numbers(layer.weights[rows], layer.base, layer.shape[1])]
            yield f"{name}({o},{','.join(map(str, numbers))})"
        yield "x=y;}"

    def _output(self, op: Dot, base: int) -> str:
        number = self.language.number
        row, _, step = multiples(self.program.constants[op.row])
        blocks = row.reshape(-1, 4)
        terms = []
        for k in range(0, len(blocks) - 1, 2):
            terms.append(f"E({k},{','.join(map(str, _numbers(blocks[k : k + 2].T, base, 2)))})")
        if len(blocks) % 2:
            terms.append(f"dot(vec4({','.join(map(str, blocks[-1]))}),x[{len(blocks) - 1}])")
        return f"float {op.result}={number(step * op.scale)}*({'+'.join(terms)})+({number(op.bias)});"


def whole_layer(program: Program, op: Affine) -> WholeLayer:
    """Return a layer as integers. Raises ValueError for weights that are not multiples of a step."""
    matrix = program.constants[op.matrix]
    if op.source == INPUT:  # The steps of the matrix and of its last column, the bias, go into the input.
        weights, h, step = multiples(matrix[:, :3])
        bias, k, bias_step = multiples(matrix[:, 3:])
        empty = np.empty(0, np.int64)
        return WholeLayer(np.hstack([weights, bias]), empty, 2 * max(h, k) + 1, 1.0, (step, step, step, bias_step))
    bias_row = program.constants[op.bias] if op.bias else np.zeros(len(matrix), np.float32)
    weights, h, step = multiples(matrix)
    if not are_multiples(bias_row, step):
        raise ValueError(f"{op.bias} is not quantized with its layer's step")
    return WholeLayer(weights, np.rint(bias_row / step).astype(np.int64), 2 * h + 1, step, ())


def _numbers(rows: Whole, base: int, digits: int) -> list[int]:
    """Return the integers of four rows (4, columns) of multiples: four for each group of `digits` columns."""
    places = [base**place for place in range(digits)]
    chunks = (rows[:, k : k + digits] + base // 2 for k in range(0, rows.shape[1], digits))
    return [
        sum(int(digit) * place for digit, place in zip(row, places, strict=True)) for rows in chunks for row in rows
    ]


def _row_macro(name: str, inputs: int, digits: int, biased: bool) -> str:
    """Return the macro that computes y[j] from the biases and integers of four rows; see `WholeLayer.shape`."""
    letters = (letter for letter in ascii_lowercase if letter not in "jxy")
    further = (f"{letter}{k}" for k in count() for letter in ascii_lowercase)
    names = [next(letters, None) or next(further) for _ in range(4 * inputs // digits + 4 * biased)]
    fours = [f"ivec4({','.join(names[k : k + 4])})" for k in range(0, len(names), 4)]
    terms = [f"vec4{fours.pop(0)[5:]}"] if biased else []
    for i in range(inputs // 4):
        matrix = f"M({fours[i]})" if digits == 4 else f"N({fours[2 * i]},{fours[2 * i + 1]})"
        terms.append(f"{matrix}*x[{i}]")
    return f"#define {name}(j,{','.join(names)})y[j]=sin(S*({'+'.join(terms)}));"


def multiples(array: Array) -> tuple[Whole, int, float]:
    """Return weights as multiples of their step, the largest multiple, and the step. Raises ValueError for others."""
    step = step_of(array, LARGEST)
    if step is None:
        raise ValueError(f"weights are not multiples, up to {LARGEST}, of one step")
    whole = np.rint(array.astype(np.float64) / step).astype(np.int64)
    return whole, max(1, int(np.abs(whole).max())), step
