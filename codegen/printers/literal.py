"""Weights as named constants in straight-line code."""

from collections.abc import Iterator

from ..ir.program import Affine, Array, Dot, Function, Op, Transposed
from .cstyle import Blocks, Storage, constants_of


class Literal(Storage):
    """Fastest where it compiles: long to compile when wide (a crash of SwiftShader at 256)."""

    def declarations(self, functions: tuple[Function, ...]) -> list[str]:
        """One `const vec4` or `const mat4` per block, shared by value and gradient."""
        lines = []
        for name in constants_of(functions):
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

    def statements(self, ops: tuple[Op, ...], blocks: Blocks) -> Iterator[str]:
        """Unrolled; one `+=` per term, since compilers limit the size of an expression (ANGLE: about 250 terms)."""
        for op in ops:
            yield from self._statement(op, blocks)

    def _statement(self, op: Op, blocks: Blocks) -> Iterator[str]:
        match op:
            case Affine(result=result, source=source, matrix=matrix, bias=bias):
                for o in range(blocks[result]):
                    terms = [f"{matrix}_{o}_{i} * {self.block(source, str(i), blocks)}" for i in range(blocks[source])]
                    first = f"{bias}_{o}" if bias else terms.pop(0)
                    yield from self._sum("vec4", self.block(result, str(o), blocks), first, terms)
            case Transposed(result=result, source=source, matrix=matrix):
                for i in range(blocks[result]):
                    terms = [f"{self.block(source, str(o), blocks)} * {matrix}_{o}_{i}" for o in range(blocks[source])]
                    yield from self._sum("vec4", self.block(result, str(i), blocks), terms.pop(0), terms)
            case Dot(result=result, source=source, row=row, scale=scale, bias=bias):
                terms = [f"dot({row}_{k}, {self.block(source, str(k), blocks)})" for k in range(blocks[source])]
                if scale == 1.0:
                    yield from self._sum("float", result, self.language.number(bias), terms)
                else:
                    yield from self._sum("float", result, terms.pop(0), terms)
                    yield f"{result} = {self.language.number(scale)} * {result} + {self.language.number(bias)};"
            case _:
                for k in range(blocks[op.result]):
                    yield f"vec4 {self.block(op.result, str(k), blocks)} = {self.elementwise(op, str(k), blocks)};"

    def loops(self, function: Function) -> int:
        """None."""
        return 0

    def block(self, name: str, k: str, blocks: Blocks) -> str:
        """Its own variable; a value of one block has no number."""
        return name if blocks.get(name) == 1 else f"{name}_{k}"

    def _constant(self, kind: str, name: str, values: Array) -> str:
        return self.language.constant.format(type=kind, name=name, value=self.language.vector(values))

    @staticmethod
    def _sum(kind: str, name: str, first: str, terms: list[str]) -> Iterator[str]:
        yield f"{kind} {name} = {first};"
        yield from (f"{name} += {term};" for term in terms)
