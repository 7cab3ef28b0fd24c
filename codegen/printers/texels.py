"""Prints weights in an RGBA32F texture, which loops read by texelFetch, for layers of any width."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...ir.program import Affine, Array, Dot, Function, Op, Product, Program, Transposed
from .cstyle import Blocks, Language, Storage, constants_of

TEXTURE_WIDTH = 1024
"""Texels in a row of the texture; Language.texel has the same number."""
UNROLL = 32
"""Most mat4 products in one iteration of a loop: a larger number means fewer iterations and longer code."""


@dataclass(frozen=True, eq=False)
class TexelLayout:
    """The place of each constant in the texture: a run of texels.

    A vector is stored block by block, one texel each. A matrix is stored mat4 by mat4 along its rows, and a mat4 is
    four texels, its columns.
    """

    offsets: dict[str, int]
    """Name of a constant -> index of its first texel."""
    texels: Array
    """(T, 4), one constant after another."""

    def image(self) -> Array | None:
        """Return the texture, (H, 1024, 4) float32, padded with zeros; None where nothing is stored."""
        if not len(self.texels):
            return None
        height = -(-len(self.texels) // TEXTURE_WIDTH)
        image = np.zeros((height * TEXTURE_WIDTH, 4), np.float32)
        image[: len(self.texels)] = self.texels
        return image.reshape(height, TEXTURE_WIDTH, 4)


def lay_out(program: Program, functions: tuple[Function, ...]) -> TexelLayout:
    """Lay out the constants of some functions, in order of first use."""
    offsets: dict[str, int] = {}
    runs = [np.empty((0, 4), np.float32)]
    size = 0
    for name in constants_of(functions):
        constant = program.constants[name]
        if constant.ndim == 2:
            rows, columns = constant.shape
            constant = constant.reshape(rows // 4, 4, columns // 4, 4).transpose(0, 2, 3, 1)
        offsets[name] = size
        runs.append(constant.reshape(-1, 4))
        size += len(runs[-1])
    return TexelLayout(offsets, np.concatenate(runs))


class TexelStorage(Storage):
    """Weights in texels.

    A value of n blocks is an array of n vec4. It is one vec4 if n is 1, or if only the loop that computes it reads it:
    arrays cost memory, and SwiftShader has 512 KiB for one fragment.
    """

    def __init__(self, program: Program, language: Language, functions: tuple[Function, ...]) -> None:
        super().__init__(program, language, functions)
        self.layout = lay_out(program, functions)

    def declarations(self) -> list[str]:
        """Return the functions texel(k) and block(k), which read one texel and one mat4."""
        if not self.functions:
            return []
        return [
            f"{self.language.begin('vec4', 'texel', 'int k')} return {self.language.texel.format(k='k')}; }}",
            self.language.begin("mat4", "block", "int k")
            + " return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }",
        ]

    def statements(self, function: Function) -> Iterator[str]:
        """Yield one loop over k for each run of ops; see _runs.

        Few and nested loops are not only fast: for a long sequence of loops, LLVM 15 takes exponential time to analyze
        the counter that llvmpipe adds (minutes for five layers of 32).
        """
        blocks = self.blocks(function)
        runs = _runs(function.ops, blocks)
        for i, run in enumerate(runs):
            later = {name for other in runs[i + 1 :] for op in other for name in _sources(op)} | set(function.outputs)
            inner = {op.result for op in run if not isinstance(op, Dot)} - later
            names = blocks | dict.fromkeys(inner, 1)
            before, body, after = [], [], []
            for op in run:
                if isinstance(op, Dot):
                    number = self.language.number
                    before.append(f"float {op.result} = 0.;")
                    body.append(f"{op.result} += dot({self._at(op.row, names)}, {self._at(op.source, names)});")
                    after.append(f"{op.result} = {number(op.scale)} * {op.result} + {number(op.bias)};")
                    continue
                n = names[op.result]
                if op.result not in inner:
                    before.append(f"vec4 {op.result}{'' if n == 1 else f'[{n}]'};")
                if isinstance(op, Affine | Transposed):
                    body += self._product(op, blocks)
                    right = "s"
                else:
                    right = self.elementwise(op, partial(self._at, blocks=names))
                body.append(f"{'vec4 ' if op.result in inner else ''}{self._at(op.result, names)} = {right};")
            yield from before
            yield from _loop("k", _length(run[0], blocks), body)
            yield from after

    def loops(self, function: Function) -> int:
        """Return the loop iterations of one call as llvmpipe counts them: one more per loop, for its exit."""
        blocks = self.blocks(function)
        total = 0
        for run in _runs(function.ops, blocks):
            sources = [blocks[op.source] for op in run if isinstance(op, Affine | Transposed)]
            inner = sum(m // _unroll(m) + 1 for m in sources if m > 1)
            total += _length(run[0], blocks) * (1 + inner) + 1
        return total

    def _product(self, op: Affine | Transposed, blocks: Blocks) -> Iterator[str]:
        """Yield the lines that compute `s`, block k of a matrix's product with the source."""
        n, m, base = blocks[op.result], blocks[op.source], self.layout.offsets[op.matrix]
        start = "vec4(0)"
        if isinstance(op, Transposed):
            term = f"s += {self._at(op.source, blocks, '{j}')} * block({base} + 4 * k + {4 * n} * ({{j}}));"
        else:
            term = f"s += block({base} + {4 * m} * k + 4 * ({{j}})) * {self._at(op.source, blocks, '{j}')};"
            start = start if op.bias is None else self._at(op.bias, blocks)
        yield f"vec4 s = {start};"
        unroll = _unroll(m)
        if m == 1:
            yield term.format(j=0)
        else:
            yield from _loop("j", m, [term.format(j=f"j + {u}" if u else "j") for u in range(unroll)], unroll)

    def _at(self, name: str, blocks: Blocks, k: str = "k") -> str:
        """Return block `k`: an array's element, or a texel of a constant."""
        if name in self.layout.offsets:
            return f"texel({self.layout.offsets[name]} + {k})"
        return name if blocks[name] == 1 else f"{name}[{k}]"


def _sources(op: Op) -> tuple[str, ...]:
    """Return the values that an op reads."""
    return (op.left, op.right) if isinstance(op, Product) else (op.source,)


def _length(op: Op, blocks: Blocks) -> int:
    """Return the number of blocks of an op's loop."""
    return blocks[op.source if isinstance(op, Dot) else op.result]


def _runs(ops: tuple[Op, ...], blocks: Blocks) -> list[list[Op]]:
    """Split ops into runs, each of which can be one loop over blocks.

    A product with a matrix needs its whole source, so it begins a run.
    """
    runs: list[list[Op]] = []
    for op in ops:
        needs_whole = isinstance(op, Affine | Transposed)
        if needs_whole or not runs or _length(op, blocks) != _length(runs[-1][0], blocks):
            runs.append([])
        runs[-1].append(op)
    return runs


def _unroll(count: int) -> int:
    """Return how many of a loop's `count` terms are in one iteration."""
    # Never all of them: an inner loop keeps LLVM's analysis short (see TexelStorage.statements).
    return max(u for u in range(1, UNROLL + 1) if count % u == 0 and (u < count or u == 1))


def _loop(variable: str, count: int, body: list[str], step: int = 1) -> Iterator[str]:
    advance = f"++{variable}" if step == 1 else f"{variable} += {step}"
    yield f"for (int {variable} = 0; {variable} < {count}; {advance}) {{"
    yield from (f"    {line}" for line in body)
    yield "}"
