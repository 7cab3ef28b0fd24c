"""Shared by all printers: the table of a C-like language's syntax, and `Storage`, which prints functions."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ...ir.program import INPUT, Affine, Cosine, Dot, Function, Product, Program, Scale, Sine, Transposed


@dataclass(frozen=True)
class Language:
    """Syntax of a C-like language with vec4 and column-major mat4. The defaults are GLSL's; the strings are formats."""

    constant: str = "const {type} {name} = {value};"
    """A global constant."""
    function: str = "{type} {name}({parameters})"
    """Head of a function's definition."""
    out: str = "out {type} {name}"
    """An output parameter."""
    suffix: str = ""
    """Suffix of float literals."""
    texel: str = "texelFetch(weights, ivec2(({k}) & 1023, ({k}) >> 10), 0)"
    """Texel {k} of the weight texture, which is 1,024 texels wide (texels.py)."""
    sine: str = "sin"
    """Name of the sine of a vec4."""
    cosine: str = "cos"
    """Name of the cosine of a vec4."""
    types: Mapping[str, str] = field(default_factory=dict)
    """GLSL's name of a type -> the language's, where it differs."""
    parameter: str = "{type} {name}"
    """A parameter of a function."""
    variable: str = "{type} {name} = {value};"
    """A local variable."""
    product: str = "{matrix} * {vector}"
    """A mat4 times a vec4."""
    transposed: str = "{vector} * {matrix}"
    """The transpose of a mat4 times a vec4."""
    by_columns: bool = False
    """Whether a mat4 is constructed from its four columns instead of 16 numbers."""

    pick: str = "({condition} ? {yes} : {no})"
    """One of two floats by a condition."""
    assign: str = "{name} = {value};"
    """A new value of an output parameter."""
    loop: str = "for (int i = 0; i < {count}; i++) {{"
    """First line of a loop."""

    def type(self, kind: str) -> str:
        """Return the language's name of a type of GLSL."""
        return self.types.get(kind, kind)

    def begin(self, kind: str, name: str, parameters: str) -> str:
        """Return the first line of a function's definition. kind: type of the result."""
        return self.function.format(type=self.type(kind), name=name, parameters=parameters) + " {"

    def taken(self, *parameters: tuple[str, str]) -> str:
        """Return parameters (type, name) as text for `begin`."""
        return ", ".join(self.parameter.format(type=self.type(kind), name=name) for kind, name in parameters)

    def local(self, kind: str, name: str, value: str) -> str:
        """Return the declaration of a local variable."""
        return self.variable.format(type=self.type(kind), name=name, value=value)

    def number(self, value: float) -> str:
        """Return the shortest float literal of the same float32."""
        text = str(np.float32(value)).replace("e-0", "e-").replace("e+", "e")
        if text.startswith(("0.", "-0.")) and text not in ("0.0", "-0.0"):
            text = text.replace("0.", ".", 1)
        return text.removesuffix("0") + self.suffix if text.endswith(".0") else text + self.suffix

    def vector(self, values: np.ndarray) -> str:
        """Return a vec4 of 4 values, or a mat4 of 16 in column-major order."""
        kind = self.type({4: "vec4", 16: "mat4"}[len(values)])
        if len(values) == 16 and self.by_columns:
            return f"{kind}({', '.join(self.vector(column) for column in values.reshape(4, 4))})"
        return f"{kind}({', '.join(self.number(value) for value in values)})"


Blocks = dict[str, int]
"""Name of a value -> number of its vec4."""


class Storage(ABC):
    """A way to store the weights of some functions of a program. It prints these functions."""

    def __init__(self, program: Program, language: Language, functions: tuple[Function, ...]) -> None:
        self.program = program
        self.language = language
        self.functions = functions

    @abstractmethod
    def declarations(self) -> list[str]:
        """Return the functions' global declarations."""

    @abstractmethod
    def statements(self, function: Function) -> Iterator[str]:
        """Yield the body of one of the functions, which assigns the values of its ops. The input is a vec4 `p`."""

    def loops(self, function: Function) -> int:
        """Return an upper bound of the loop iterations of one call: 0 for unrolled code."""
        return 0

    def definition(self, function: Function) -> list[str]:
        """Return the lines of one of the functions."""
        kind, result = _result(function, self.program.widths(function), self.language)
        lines = [f"    {line}" for line in self.statements(function)]
        return [
            self.language.begin(kind, function.name, self.language.taken(("vec4", "p"))),
            *lines,
            f"    return {result};",
            "}",
        ]

    def blocks(self, function: Function) -> Blocks:
        """Return the number of vec4 in each value of a function."""
        return {name: -(-width // 4) for name, width in self.program.widths(function).items()}

    def elementwise(self, op: Sine | Cosine | Product | Scale, at: Callable[[str], str]) -> str:
        """Return the right-hand side of one block of an op. at: name of an operand -> text of its block."""
        match op:
            case Sine(source=source):
                return f"{self.language.sine}({at(source)})"
            case Cosine(source=source):
                return f"{self.language.cosine}({at(source)})"
            case Product(left=left, right=right):
                return f"{at(left)} * {at(right)}"
            case Scale(source=source, factor=factor):
                return f"{self.language.number(factor)} * {at(source)}"


def _result(function: Function, widths: dict[str, int], language: Language) -> tuple[str, str]:
    """Return the type of a function's result, and the returned expression."""
    match [widths[name] for name in function.outputs]:
        case [1]:
            return "float", function.outputs[0]
        case [4, 1]:
            return "vec4", "{}({}.xyz, {})".format(language.type("vec4"), *function.outputs)
        case [1, 1, 1]:
            return "vec3", f"{language.type('vec3')}({', '.join(function.outputs)})"
        case other:
            raise ValueError(f"{function.name}: no C type for outputs of widths {other}")


def constants_of(functions: tuple[Function, ...]) -> list[str]:
    """Return the names of the constants of some functions, in order of first use."""
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
