"""Weights in an RGBA32F texture, read by texelFetch in loops: the portable store for wide layers."""

from collections.abc import Iterator

import numpy as np

from ..ir.program import Affine, Array, Dot, Function, Op, Program, Transposed
from .cstyle import Blocks, Language, Storage, constants_of

TEXTURE_WIDTH = 1024
UNROLL = 32
"""mat4 products per loop iteration: fewer iterations, longer code."""


class Texture(Storage):
    """Values are arrays of vec4; a constant is a run of texels, a matrix block four of them (its columns)."""

    def __init__(self, program: Program, language: Language) -> None:
        super().__init__(program, language)
        self.offsets: dict[str, int] = {}
        self.texels: list[Array] = []
        self.size = 0

    def declarations(self, functions: tuple[Function, ...]) -> list[str]:
        """Readers of one texel and of one block; lays the constants out in the texture."""
        for name in constants_of(functions):
            constant = self.program.constants[name]
            if constant.ndim == 2:
                rows, columns = constant.shape
                constant = constant.reshape(rows // 4, 4, columns // 4, 4).transpose(0, 2, 3, 1)
            self.offsets[name] = self.size
            self.texels.append(constant.reshape(-1, 4))
            self.size += len(self.texels[-1])
        if not functions:
            return []
        return [
            f"{self.language.begin('vec4', 'texel', 'int k')} return {self.language.texel.format(k='k')}; }}",
            self.language.begin("mat4", "block", "int k")
            + " return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }",
        ]

    def image(self) -> Array | None:
        """The texture, (H, 1024, 4) float32, or None where nothing is stored in it."""
        if not self.texels:
            return None
        height = -(-self.size // TEXTURE_WIDTH)
        image = np.zeros((height * TEXTURE_WIDTH, 4), np.float32)
        image[: self.size] = np.concatenate(self.texels)
        return image.reshape(height, TEXTURE_WIDTH, 4)

    def statements(self, ops: tuple[Op, ...], blocks: Blocks) -> Iterator[str]:
        """One loop for each run of ops that go over the same blocks.

        Few loops, and loops within loops, not only for speed: in a long row of plain ones, LLVM 15's analysis of the
        counter that llvmpipe adds takes exponential time (minutes for five layers of 32).
        """
        for group in _fused(ops, blocks):
            before, body, after = [], [], []
            for op in group:
                if isinstance(op, Dot):
                    number = self.language.number
                    before.append(f"float {op.result} = 0.;")
                    body.append(f"{op.result} += dot({self._at(op.row, blocks)}, {self._at(op.source, blocks)});")
                    after.append(f"{op.result} = {number(op.scale)} * {op.result} + {number(op.bias)};")
                    continue
                n = blocks[op.result]
                before.append(f"vec4 {op.result}{'' if n == 1 else f'[{n}]'};")
                if isinstance(op, Affine | Transposed):
                    body += self._product(op, blocks)
                else:
                    body.append(f"{self._at(op.result, blocks)} = {self.elementwise(op, 'k', blocks)};")
            yield from before
            yield from _loop("k", _length(group[0], blocks), body)
            yield from after

    def loops(self, function: Function) -> int:
        """Iterations as llvmpipe counts them, the one that finds the end of its loop included."""
        blocks = self.blocks(function)
        total = 0
        for group in _fused(function.ops, blocks):
            sources = [blocks[op.source] for op in group if isinstance(op, Affine | Transposed)]
            inner = sum(m // _unroll(m) + 1 for m in sources if m > 1)
            total += _length(group[0], blocks) * (1 + inner) + 1
        return total

    def _product(self, op: Affine | Transposed, blocks: Blocks) -> Iterator[str]:
        """The matrix times the source, for block k of the result."""
        n, m, base = blocks[op.result], blocks[op.source], self.offsets[op.matrix]
        start = "vec4(0)"
        if isinstance(op, Transposed):
            term = f"s += {self.block(op.source, '{j}', blocks)} * block({base} + 4 * k + {4 * n} * ({{j}}));"
        else:
            term = f"s += block({base} + {4 * m} * k + 4 * ({{j}})) * {self.block(op.source, '{j}', blocks)};"
            start = start if op.bias is None else self._at(op.bias, blocks)
        yield f"vec4 s = {start};"
        unroll = _unroll(m)
        if m == 1:
            yield term.format(j=0)
        else:
            yield from _loop("j", m, [term.format(j=f"j + {u}" if u else "j") for u in range(unroll)], unroll)
        yield f"{self._at(op.result, blocks)} = s;"

    def _at(self, name: str, blocks: Blocks) -> str:
        return self.block(name, "k", blocks)

    def block(self, name: str, k: str, blocks: Blocks) -> str:
        """An array element, or a texel of a constant."""
        if name in self.offsets:
            return f"texel({self.offsets[name]} + {k})"
        return name if blocks[name] == 1 else f"{name}[{k}]"


def _length(op: Op, blocks: Blocks) -> int:
    return blocks[op.source if isinstance(op, Dot) else op.result]


def _fused(ops: tuple[Op, ...], blocks: Blocks) -> list[list[Op]]:
    """Runs of ops over equally many blocks, none of which needs a whole vector that its own run makes."""
    groups: list[list[Op]] = []
    for op in ops:
        whole = isinstance(op, Affine | Transposed)
        if whole or not groups or _length(op, blocks) != _length(groups[-1][0], blocks):
            groups.append([])
        groups[-1].append(op)
    return groups


def _unroll(count: int) -> int:
    # Never all of it: an inner loop keeps LLVM's analysis short (see Texture.statements).
    return max(u for u in range(1, UNROLL + 1) if count % u == 0 and (u < count or u == 1))


def _loop(variable: str, count: int, body: list[str], step: int = 1) -> Iterator[str]:
    advance = f"++{variable}" if step == 1 else f"{variable} += {step}"
    yield f"for (int {variable} = 0; {variable} < {count}; {advance}) {{"
    yield from (f"    {line}" for line in body)
    yield "}"
