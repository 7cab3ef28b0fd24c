"""Quantised weights (model/quantise.py) as whole numbers, which make a short text.

Sixteen weights of a hidden layer are packed in three integers. Compilers fold the unpacking, so that the weights are
constants all the same.
"""

from collections.abc import Iterable, Iterator
from string import ascii_lowercase

import numpy as np

from ...model.quantise import MAX_FINE, MAX_HIDDEN, are_multiples, step_of
from ..ir.program import INPUT, Affine, Array, Dot, Function, Sine
from .cstyle import Storage

UNPACK = """\
mat4 M(int a,int b,int c){ // 16 weights of 6 bits
ivec3 v=ivec3(a,b,c),u=v>>30&3;
return mat4(v<<26>>26,u.x*16+u.y*4+u.z-32,v<<20>>26,v<<14>>26,v<<8>>26,v<<2>>26);
}"""
"""GLSL of the function that unpacks what `pack` packs."""
FIELDS = ((0, 4, 7, 10, 13), (1, 5, 8, 11, 14), (2, 6, 9, 12, 15))
"""Which of the sixteen numbers each integer holds, 6 bits each from its lowest up.

Number 3 is spread over the top two bits of all three.
"""
LAYERS = ascii_lowercase
"""The names of the layers' values, in order."""


def pack(block: Array) -> str:
    """Return a mat4 as text, `M(...)`.

    block: (16,) whole numbers from -32 to 31, column after column. Raises ValueError where one is larger.
    """
    whole = [int(value) for value in np.rint(block)]
    if not all(-32 <= value < 32 for value in whole):
        raise ValueError("a weight is not a multiple of its step that fits 6 bits")
    integers = []
    for position, fields in enumerate(FIELDS):
        packed = (whole[3] + 32 >> 4 - 2 * position & 3) << 30
        for k, field in enumerate(fields):
            packed |= (whole[field] & 63) << 6 * k
        integers.append(packed - (1 << 32 if packed >> 31 else 0))
    return f"M({','.join(map(str, integers))})"


class PackedStorage(Storage):
    """Weights as whole numbers, for functions that compute values only: it prints no gradients.

    A value of a layer is variables a0, a1, ... of the first layer, b0, b1, ... of the second, each a vec4 that one
    expression computes: sin(step * (M(..) * a0 + M(..) * a1 + ... + vec4(..))).
    """

    def declarations(self) -> list[str]:
        """Return the function that unpacks a mat4."""
        return UNPACK.splitlines() if self.functions else []

    def statements(self, function: Function) -> Iterator[str]:
        """Yield a layer's lines for each Affine and the Sine after it, and an output's for each Dot.

        Raises ValueError for other ops, and for weights that are not quantised.
        """
        letters = {INPUT: INPUT}
        for op, after in zip(function.ops, (*function.ops[1:], None), strict=True):
            match op, after:
                case Affine(source=source), Sine(result=result):
                    letters[result] = LAYERS[len(letters) - 1]
                    layer = self._first if source == INPUT else self._hidden
                    yield from layer(op, letters[source], letters[result])
                case Sine(), _:
                    pass
                case Dot(source=source), _:
                    yield self._output(op, letters[source])
                case _:
                    raise ValueError(f"{type(op).__name__} cannot be packed")

    def _first(self, op: Affine, source: str, result: str) -> Iterator[str]:
        """Yield the first layer: the steps of its columns go into the input, and its matrices are whole numbers."""
        matrix = self.program.constants[op.matrix]
        steps = np.array([*[_step(matrix[:, :3], MAX_FINE)] * 3, _step(matrix[:, 3], MAX_FINE)])
        yield f"{source}*=vec4({','.join(map(self.language.number, steps))});"
        yield from _declared(
            f"{result}{o}=sin(mat4({_whole((block / steps).T.ravel())})*{source})"
            for o, block in enumerate(matrix.reshape(-1, 4, 4))
        )

    def _hidden(self, op: Affine, source: str, result: str) -> Iterator[str]:
        matrix = self.program.constants[op.matrix]
        bias = self.program.constants[op.bias] if op.bias else np.zeros(len(matrix), np.float32)
        step = _step(matrix, MAX_HIDDEN)
        if not are_multiples(bias, step):
            raise ValueError(f"{op.bias} is not quantised with its layer's step")
        rows = []
        for o in range(len(matrix) // 4):
            terms = [
                f"{pack(matrix[4 * o : 4 * o + 4, 4 * i : 4 * i + 4].T.ravel() / step)}*{source}{i}"
                for i in range(matrix.shape[1] // 4)
            ]
            terms.append(f"vec4({_whole(bias[4 * o : 4 * o + 4] / step)})")
            rows.append(f"{result}{o}=sin({self.language.number(step)}*({'+'.join(terms)}))")
        yield from _declared(rows)

    def _output(self, op: Dot, source: str) -> str:
        row, number = self.program.constants[op.row], self.language.number
        step = _step(row, MAX_FINE)
        parts = (row / step).reshape(-1, 4)
        terms = "+".join(f"dot(vec4({_whole(part)}),{source}{k})" for k, part in enumerate(parts))
        return f"float {op.result}={number(step * op.scale)}*({terms})+{number(op.bias)};"


def _declared(assignments: Iterable[str]) -> Iterator[str]:
    """Yield one declaration of several vec4, a line for each."""
    lines = list(assignments)
    return (f"{'' if k else 'vec4 '}{line}{',' if k + 1 < len(lines) else ';'}" for k, line in enumerate(lines))


def _whole(values: Array) -> str:
    """Return the nearest whole numbers as text, with commas between."""
    return ",".join(str(int(value)) for value in np.rint(values))


def _step(array: Array, largest: int) -> float:
    """Return the step of quantised weights (model/quantise.py). Raises ValueError where they are not quantised."""
    step = step_of(array, largest)
    if step is None:
        raise ValueError(f"weights are not multiples, up to {largest}, of one step")
    return step
