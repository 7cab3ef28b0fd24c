"""Weights in an RGBA32F texture, read by texelFetch in loops: the portable store for wide layers."""

from collections.abc import Iterator

import numpy as np

from .cstyle import Blocks, Language, Storage, constants_of
from .program import Affine, Array, Dot, Function, Op, Program, Transposed

TEXTURE_WIDTH = 1024
UNROLL = 8
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
            f"vec4 texel(int k) {{ return {self.language.texel.format(k='k')}; }}",
            "mat4 block(int k) { return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }",
        ]

    def image(self) -> Array | None:
        """The texture, (H, 1024, 4) float32, or None where nothing is stored in it."""
        if not self.texels:
            return None
        height = -(-self.size // TEXTURE_WIDTH)
        image = np.zeros((height * TEXTURE_WIDTH, 4), np.float32)
        image[: self.size] = np.concatenate(self.texels)
        return image.reshape(height, TEXTURE_WIDTH, 4)

    def statements(self, op: Op, blocks: Blocks) -> Iterator[str]:
        """A loop over the result's blocks; inside, a loop over the source's, unrolled by `_unroll`."""
        number = self.language.number
        if isinstance(op, Dot):
            term = f"{op.result} += dot({self.block(op.row, 'k', blocks)}, {self.block(op.source, 'k', blocks)});"
            yield f"float {op.result} = 0.;"
            yield from _loop("k", blocks[op.source], [term])
            yield f"{op.result} = {number(op.scale)} * {op.result} + {number(op.bias)};"
            return
        n = blocks[op.result]
        yield f"vec4 {op.result}{'' if n == 1 else f'[{n}]'};"
        result = self.block(op.result, "k", blocks)
        match op:
            case Affine(source=source, matrix=matrix, bias=bias):
                start = "vec4(0)" if bias is None else self.block(bias, "k", blocks)
                row = f"{self.offsets[matrix]} + {4 * blocks[source]} * k + 4 * ({{j}})"
                term = f"s += block({row}) * {self.block(source, '{j}', blocks)};"
            case Transposed(source=source, matrix=matrix):
                start = "vec4(0)"
                column = f"{self.offsets[matrix]} + 4 * k + {4 * n} * ({{j}})"
                term = f"s += {self.block(source, '{j}', blocks)} * block({column});"
            case _:
                yield from _loop("k", n, [f"{result} = {self.elementwise(op, 'k', blocks)};"])
                return
        m = blocks[source]
        unroll = _unroll(m)
        if unroll == m:
            inner = [term.format(j=j) for j in range(m)]
        else:
            inner = list(_loop("j", m, [term.format(j=f"j + {u}" if u else "j") for u in range(unroll)], unroll))
        yield from _loop("k", n, [f"vec4 s = {start};", *inner, f"{result} = s;"])

    def loops(self, function: Function) -> int:
        """Iterations as llvmpipe counts them, the one that finds the end of its loop included."""
        widths = self.program.widths(function)
        total = 0
        for op in function.ops:
            match op:
                case Affine(result=result, source=source) | Transposed(result=result, source=source):
                    m = widths[source] // 4
                    inner = 0 if _unroll(m) == m else m // _unroll(m) + 1
                    total += widths[result] // 4 * (1 + inner) + 1
                case Dot(source=source):
                    total += widths[source] // 4 + 1
                case _:
                    total += widths[op.result] // 4 + 1
        return total

    def block(self, name: str, k: str, blocks: Blocks) -> str:
        """An array element, or a texel of a constant."""
        if name in self.offsets:
            return f"texel({self.offsets[name]} + {k})"
        return name if blocks[name] == 1 else f"{name}[{k}]"


def _unroll(count: int) -> int:
    return max(u for u in range(1, UNROLL + 1) if count % u == 0)


def _loop(variable: str, count: int, body: list[str], step: int = 1) -> Iterator[str]:
    advance = f"++{variable}" if step == 1 else f"{variable} += {step}"
    yield f"for (int {variable} = 0; {variable} < {count}; {advance}) {{"
    yield from (f"    {line}" for line in body)
    yield "}"
