"""Prints weights as named constants in straight-line code."""

from collections.abc import Iterator
from functools import partial

from ...ir.program import Affine, Array, Dot, Function, Op, Transposed
from .cstyle import Blocks, Storage, constants_of


class LiteralStorage(Storage):
    """Weights as literals: the fastest code, but slow to compile for wide layers (SwiftShader crashes at 256).

    A value of n blocks is n variables, NAME_0 to NAME_(n - 1), or NAME if n is 1.
    """

    def declarations(self) -> list[str]:
        """Return one `const vec4` or `const mat4` for each block of the constants."""
        lines = []
        for name in constants_of(self.functions):
            constant = self.program.constants[name]
            if constant.ndim == 1:
                for k, values in enumerate(constant.reshape(-1, 4)):
                    lines.append(self._constant("vec4", f"{name}_{k}", values))
                continue
            for o in range(constant.shape[0] // 4):
                for i in range(constant.shape[1] // 4):
                    values = constant[4 * o : 4 * o + 4, 4 * i : 4 * i + 4].T.ravel()
                    lines.append(self._constant("mat4", f"{name}_{o}_{i}", values))
        return lines

    def statements(self, function: Function) -> Iterator[str]:
        """Yield unrolled lines with one `+=` per term, since ANGLE limits an expression to about 250 terms."""
        blocks = self.blocks(function)
        for op in function.ops:
            yield from self._statement(op, blocks)

    def _statement(self, op: Op, blocks: Blocks) -> Iterator[str]:
        match op:
            case Affine(result=result, source=source, matrix=matrix, bias=bias):
                for o in range(blocks[result]):
                    terms = [
                        self.language.product.format(matrix=f"{matrix}_{o}_{i}", vector=_block(source, i, blocks))
                        for i in range(blocks[source])
                    ]
                    first = f"{bias}_{o}" if bias else terms.pop(0)
                    yield from self._sum("vec4", _block(result, o, blocks), first, terms)
            case Transposed(result=result, source=source, matrix=matrix):
                for i in range(blocks[result]):
                    terms = [
                        self.language.transposed.format(matrix=f"{matrix}_{o}_{i}", vector=_block(source, o, blocks))
                        for o in range(blocks[source])
                    ]
                    yield from self._sum("vec4", _block(result, i, blocks), terms.pop(0), terms)
            case Dot(result=result, source=source, row=row, scale=scale, bias=bias):
                terms = [f"dot({row}_{k}, {_block(source, k, blocks)})" for k in range(blocks[source])]
                if scale == 1.0:
                    yield from self._sum("float", result, self.language.number(bias), terms)
                else:
                    yield from self._sum("float", result, terms.pop(0), terms)
                    yield f"{result} = {self.language.number(scale)} * {result} + {self.language.number(bias)};"
            case _:
                for k in range(blocks[op.result]):
                    right = self.elementwise(op, partial(_block, k=k, blocks=blocks))
                    yield self.language.local("vec4", _block(op.result, k, blocks), right)

    def _sum(self, kind: str, name: str, first: str, terms: list[str]) -> Iterator[str]:
        yield self.language.local(kind, name, first)
        yield from (f"{name} += {term};" for term in terms)

    def _constant(self, kind: str, name: str, values: Array) -> str:
        return self.language.constant.format(
            type=self.language.type(kind), name=name, value=self.language.vector(values)
        )


def _block(name: str, k: int, blocks: Blocks) -> str:
    """Return the variable or constant of block `k`."""
    return name if blocks.get(name) == 1 else f"{name}_{k}"
