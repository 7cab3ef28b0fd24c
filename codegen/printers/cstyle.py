"""Program -> C-like text, driven by a table per language. How weights are stored is a Storage's business."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..ir.program import INPUT, Affine, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed


@dataclass(frozen=True)
class Language:
    """What differs between the C-like languages that know vec4 and column-major mat4."""

    constant: str = "const {type} {name} = {value};"
    function: str = "{type} {name}({parameters})"
    out: str = "out int {name}"
    suffix: str = ""
    texel: str = "texelFetch(weights, ivec2(({k}) & 1023, ({k}) >> 10), 0)"
    sine: str = "sin"
    cosine: str = "cos"

    def begin(self, kind: str, name: str, parameters: str) -> str:
        """First line of a function's definition."""
        return self.function.format(type=kind, name=name, parameters=parameters) + " {"

    def number(self, value: float) -> str:
        """Shortest literal that reads back as the same float32."""
        text = str(np.float32(value)).replace("e-0", "e-").replace("e+", "e")
        if text.startswith(("0.", "-0.")) and text not in ("0.0", "-0.0"):
            text = text.replace("0.", ".", 1)
        return text.removesuffix("0") + self.suffix if text.endswith(".0") else text + self.suffix

    def vector(self, values: np.ndarray) -> str:
        """vec4 or, from 16 values in column-major order, mat4."""
        kind = {4: "vec4", 16: "mat4"}[len(values)]
        return f"{kind}({', '.join(self.number(value) for value in values)})"


Blocks = dict[str, int]
"""Value name -> number of vec4 in it."""


class Storage(ABC):
    """Prints functions with their weights stored one way."""

    def __init__(self, program: Program, language: Language) -> None:
        self.program = program
        self.language = language

    @abstractmethod
    def declarations(self, functions: tuple[Function, ...]) -> list[str]:
        """Global lines that the text of `functions` refers to."""

    @abstractmethod
    def statements(self, ops: tuple[Op, ...], blocks: Blocks) -> Iterator[str]:
        """Lines for a function's ops."""

    @abstractmethod
    def loops(self, function: Function) -> int:
        """Upper bound of the loop iterations that one call of `function` costs."""

    def function(self, function: Function) -> list[str]:
        """The function's text."""
        kind, result = _result(function, self.program.widths(function))
        lines = [f"    {line}" for line in self.statements(function.ops, self.blocks(function))]
        return [self.language.begin(kind, function.name, "vec4 p"), *lines, f"    return {result};", "}"]

    def blocks(self, function: Function) -> Blocks:
        """Value name -> number of vec4 in it."""
        return {name: -(-width // 4) for name, width in self.program.widths(function).items()}

    def elementwise(self, op: Sine | Cosine | Product | Scale, k: str, blocks: Blocks) -> str:
        """Right-hand side of an elementwise op at block `k`, names resolved by `block`."""
        match op:
            case Sine(source=source):
                return f"{self.language.sine}({self.block(source, k, blocks)})"
            case Cosine(source=source):
                return f"{self.language.cosine}({self.block(source, k, blocks)})"
            case Product(left=left, right=right):
                return f"{self.block(left, k, blocks)} * {self.block(right, k, blocks)}"
            case Scale(source=source, factor=factor):
                return f"{self.language.number(factor)} * {self.block(source, k, blocks)}"

    @abstractmethod
    def block(self, name: str, k: str, blocks: Blocks) -> str:
        """Expression for vec4 block `k` of a value or constant."""


def _result(function: Function, widths: dict[str, int]) -> tuple[str, str]:
    match [widths[name] for name in function.outputs]:
        case [1]:
            return "float", function.outputs[0]
        case [4, 1]:
            return "vec4", "vec4({}.xyz, {})".format(*function.outputs)
        case [1, 1, 1]:
            return "vec3", f"vec3({', '.join(function.outputs)})"
        case other:
            raise ValueError(f"{function.name}: no C type for outputs of widths {other}")


def constants_of(functions: tuple[Function, ...]) -> list[str]:
    """Names of the constants that `functions` use, each once, in order of use."""
    names: dict[str, None] = {}
    for function in functions:
        assigned = {INPUT} | {op.result for op in function.ops}
        for op in function.ops:
            match op:
                case Affine(matrix=matrix, bias=bias):
                    names |= {matrix: None} | ({} if bias is None else {bias: None})
                case Transposed(matrix=matrix):
                    names[matrix] = None
                case Dot(row=row):
                    names[row] = None
                case Product(left=left) if left not in assigned:
                    names[left] = None
    return list(names)
