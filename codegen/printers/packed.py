"""Weights as whole numbers, the hidden layers' sixteen to three integers: little text, and constants all the same.

Only for values, and for quantised weights (model/quantise.py).
"""

from collections.abc import Iterable, Iterator

import numpy as np

from ...model.quantise import MAX_FINE, MAX_HIDDEN, are_multiples, step_of
from ..ir.program import INPUT, Affine, Array, Dot, Function, Op, Sine
from .cstyle import Blocks, Storage

UNPACK = """\
mat4 M(int a,int b,int c){ // 16 weights of 6 bits
ivec3 v=ivec3(a,b,c),u=v>>30&3;
return mat4(v<<26>>26,u.x*16+u.y*4+u.z-32,v<<20>>26,v<<14>>26,v<<8>>26,v<<2>>26);
}"""
FIELDS = ((0, 4, 7, 10, 13), (1, 5, 8, 11, 14), (2, 6, 9, 12, 15))
"""Which of the sixteen are in each integer, from its lowest bits; number 3 is in the top two bits of all three."""
LAYERS = "abcdefgh"


def pack(block: Array) -> str:
    """`M(...)` for 16 whole numbers from -32 to 31, column after column."""
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


class Packed(Storage):
    """One expression per vec4: sin(step * (M(..) * a0 + M(..) * a1 + ... + vec4(..)))."""

    def declarations(self, functions: tuple[Function, ...]) -> list[str]:
        """The function that unpacks."""
        return UNPACK.splitlines() if functions else []

    def statements(self, ops: tuple[Op, ...], blocks: Blocks) -> Iterator[str]:
        """A layer is an Affine and the Sine after it."""
        for op, after in zip(ops, (*ops[1:], None), strict=True):
            match op, after:
                case Affine(source=source), Sine(result=result):
                    yield from (self._first if source == INPUT else self._hidden)(op, result, blocks)
                case Sine(), _:
                    pass
                case Dot(), _:
                    yield self._output(op, blocks)
                case _:
                    raise ValueError(f"{type(op).__name__} cannot be packed")

    def loops(self, function: Function) -> int:
        """None."""
        return 0

    def block(self, name: str, k: str, blocks: Blocks) -> str:
        """Its own variable: a0, a1, ... of the first layer, b0, b1, ... of the second."""
        return f"{LAYERS[int(name.removeprefix('h'))]}{k}"

    def _first(self, op: Affine, result: str, blocks: Blocks) -> Iterator[str]:
        matrix = self.program.constants[op.matrix]
        steps = np.array([*[_step(matrix[:, :3], MAX_FINE)] * 3, _step(matrix[:, 3], MAX_FINE)])
        yield f"{INPUT}*=vec4({','.join(map(self.language.number, steps))});"
        rows = (
            f"{self.block(result, str(o), blocks)}=sin(mat4({_whole((block / steps).T.ravel())})*{INPUT})"
            for o, block in enumerate(matrix.reshape(-1, 4, 4))
        )
        yield from _declared(rows)

    def _hidden(self, op: Affine, result: str, blocks: Blocks) -> Iterator[str]:
        matrix = self.program.constants[op.matrix]
        bias = self.program.constants[op.bias] if op.bias else np.zeros(len(matrix), np.float32)
        step = _step(matrix, MAX_HIDDEN)
        if not are_multiples(bias, step):
            raise ValueError(f"{op.bias} is not quantised with its layer's step")
        rows = []
        for o in range(blocks[result]):
            terms = [
                f"{pack(matrix[4 * o : 4 * o + 4, 4 * i : 4 * i + 4].T.ravel() / step)}*"
                f"{self.block(op.source, str(i), blocks)}"
                for i in range(blocks[op.source])
            ]
            terms.append(f"vec4({_whole(bias[4 * o : 4 * o + 4] / step)})")
            rows.append(f"{self.block(result, str(o), blocks)}=sin({self.language.number(step)}*({'+'.join(terms)}))")
        yield from _declared(rows)

    def _output(self, op: Dot, blocks: Blocks) -> str:
        row, number = self.program.constants[op.row], self.language.number
        step = _step(row, MAX_FINE)
        parts = (row / step).reshape(-1, 4)
        terms = "+".join(
            f"dot(vec4({_whole(part)}),{self.block(op.source, str(k), blocks)})" for k, part in enumerate(parts)
        )
        return f"float {op.result}={number(step * op.scale)}*({terms})+{number(op.bias)};"


def _declared(rows: Iterable[str]) -> Iterator[str]:
    lines = list(rows)
    return (f"{'' if k else 'vec4 '}{row}{',' if k + 1 < len(lines) else ';'}" for k, row in enumerate(lines))


def _whole(values: Array) -> str:
    return ",".join(str(int(value)) for value in np.rint(values))


def _step(array: Array, largest: int) -> float:
    step = step_of(array, largest)
    if step is None:
        raise ValueError(f"weights are not multiples, up to {largest}, of one step")
    return step
