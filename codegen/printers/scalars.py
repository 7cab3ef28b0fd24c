"""Writes generated code as scalar assignments, without vectors, so that one generator serves every language."""

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...ir.program import Function
from ...model.expression import Expression
from .cstyle import Language


@dataclass(frozen=True)
class Scalar:
    """A number that only the generated code computes."""

    text: str
    """An expression that needs no parentheses as an operand."""


Number = float | Scalar
"""A float is known at generation time, and `Writer` folds it."""
Inputs = tuple[str, str, str, str]
"""Four operands: the input (x, y, z, w) of a network."""
Triple = tuple[Number, Number, Number]
"""A vector."""
FOLDED: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "min": min,
    "max": max,
}
"""Name of a scalar function -> the function that folds it."""

_WORD = re.compile(r"[A-Za-z_]\w*")
_STORED = re.compile(r"[A-Za-z_][\w.\[\]]*")
"""A variable, or an element or component of one."""


class Notation(ABC):
    """How a language writes scalars. The strings are formats."""

    functions: Mapping[str, str]
    """Name in `FOLDED` -> format with {0}, {1}, ... for the arguments."""
    pick: str
    """Choice between {yes} and {no} by a {condition}."""
    both: str
    """Conjunction of the conditions {0} and {1}."""
    let: str
    """New float variable {name} with a {value}."""
    let_condition: str
    """New bool variable {name} with a {value}."""

    @abstractmethod
    def number(self, value: float) -> str:
        """Return a literal."""

    @abstractmethod
    def call(self, name: str, function: Function, inputs: Inputs, condition: str | None) -> list[str]:
        """Return lines that store a network's outputs in the variable `name`; zeros where the condition is false."""

    @abstractmethod
    def output(self, name: str, function: Function, k: int) -> str:
        """Return output k of a variable that `call` has declared; a gradient has the outputs x, y, z, value."""


class VectorNotation(Notation):
    """How languages with vec4 write scalars."""

    both = "{0} && {1}"

    def __init__(self, language: Language) -> None:
        self.language = language
        self.pick = language.pick
        self.let, self.let_condition = (language.local(kind, "{name}", "{value}") for kind in ("float", "bool"))
        vec4 = language.type("vec4")
        # A generated sine takes a vec4; a built-in one takes a float, too.
        waves = {
            name: f"{name}({{0}})" if wave == name else f"{wave}({vec4}({{0}})).x"
            for name, wave in (("sin", language.sine), ("cos", language.cosine))
        }
        simple = {name: f"{name}({{0}})" for name in ("sqrt", "abs")}
        self.functions = {**simple, **waves, "min": "min({0}, {1})", "max": "max({0}, {1})"}

    def number(self, value: float) -> str:
        return self.language.number(value)

    def call(self, name: str, function: Function, inputs: Inputs, condition: str | None) -> list[str]:
        kind = {1: "float", 2: "vec4", 3: "vec3"}[len(function.outputs)]
        call = f"{function.name}({self.language.type('vec4')}({', '.join(inputs)}))"
        if condition is None:
            return [self.language.local(kind, name, call)]
        zero = self.number(0)
        zeros = zero if kind == "float" else f"{self.language.type(kind)}({', '.join([zero] * int(kind[3]))})"
        return [self.language.local(kind, name, zeros), f"if ({condition}) {{ {name} = {call}; }}"]

    def output(self, name: str, function: Function, k: int) -> str:
        if len(function.outputs) == 1:
            return name
        # CUDA's vec4 has only the members xyz and w.
        return f"{name}.w" if k == 3 else f"{name}{'.xyz' if len(function.outputs) == 2 else ''}.{'xyz'[k]}"


class Writer:
    """Collects assignments, and folds constants. time: name of the variable t."""

    def __init__(self, notation: Notation, time: str = "time") -> None:
        self._steps: list[tuple[str, list[str]]] = []
        self._variables: dict[str, str] = {}
        self._notation, self._time, self._count = notation, time, 0

    def lines(self, *results: Number) -> list[str]:
        """Return only the lines that the results need."""
        needed = set(_WORD.findall(" ".join(map(self.text, results))))
        kept = []
        for name, lines in reversed(self._steps):
            if name in needed:
                needed.update(*map(_WORD.findall, lines))
                kept.append(lines)
        return [line for lines in reversed(kept) for line in lines]

    def text(self, value: Number) -> str:
        """Return a number as an operand."""
        if isinstance(value, Scalar):
            return value.text
        literal = self._notation.number(value)
        return f"({literal})" if literal.startswith("-") else literal

    def let(self, value: Number) -> Number:
        """Store a number in a variable."""
        if not isinstance(value, Scalar) or _STORED.fullmatch(value.text):
            return value
        return Scalar(self._variable("a", self._notation.let, value.text))

    def let_condition(self, condition: str) -> str:
        """Store a condition in a variable."""
        return self._variable("c", self._notation.let_condition, condition)

    def add(self, a: Number, b: Number) -> Number:
        """Return a + b."""
        if 0 in (a, b):
            return b if a == 0 else a
        if isinstance(b, float) and b < 0:
            return self.sub(a, -b)
        return self._infix("+", a, b, lambda x, y: x + y)

    def sub(self, a: Number, b: Number) -> Number:
        """Return a - b."""
        if isinstance(b, float) and b < 0:
            return self.add(a, -b)
        return a if b == 0 else self._infix("-", a, b, lambda x, y: x - y)

    def mul(self, a: Number, b: Number) -> Number:
        """Return a b."""
        if 0 in (a, b):
            return 0.0
        if 1 in (a, b):
            return b if a == 1 else a
        return self._infix("*", a, b, lambda x, y: x * y)

    def div(self, a: Number, b: Number) -> Number:
        """Return a / b."""
        return a if b == 1 else self._infix("/", a, b, lambda x, y: x / y)

    def dot(self, a: Triple, b: Triple) -> Number:
        """Return the dot product of two vectors."""
        total: Number = 0.0
        for x, y in zip(a, b, strict=True):
            total = self.add(total, self.mul(x, y))
        return total

    def call(self, name: str, *values: Number) -> Number:
        """Return the result of a function in `FOLDED`."""
        known = [value for value in values if not isinstance(value, Scalar)]
        if len(known) == len(values):
            return float(FOLDED[name](*known))
        return Scalar(self._notation.functions[name].format(*(self._bare(value) for value in values)))

    def clamped(self, value: Number) -> Number:
        """Return a number clamped to [0, 1]."""
        return self.call("min", self.call("max", value, 0.0), 1.0)

    def less(self, a: Number, b: Number) -> str:
        """Return the condition a < b."""
        return f"({self.text(a)} < {self.text(b)})"

    def both(self, a: str, b: str) -> str:
        """Return the conjunction of two conditions."""
        return f"({self._notation.both.format(a, b)})"

    def pick(self, condition: str, yes: Number, no: Number) -> Number:
        """Return one of two numbers."""
        return Scalar(self._notation.pick.format(condition=condition, yes=self.text(yes), no=self.text(no)))

    def network(self, function: Function, inputs: tuple[Number, ...], condition: str | None = None) -> list[Number]:
        """Return a network's outputs at (x, y, z, w); zeros where the condition is false."""
        x, y, z, w = map(self._bare, inputs)
        name = self._name("r")
        self._steps.append((name, self._notation.call(name, function, (x, y, z, w), condition)))
        return [Scalar(self._notation.output(name, function, k)) for k in range(output_count(function))]

    def expression(self, value: Expression) -> Number:
        """Return an expression in time."""
        if not value.moves:
            return value.at(0.0)
        if value.kind == "t":
            return Scalar(self._time)
        operands = [self.expression(operand) for operand in value.operands]
        match value.kind:
            case "negative":
                return self.sub(0.0, operands[0])
            case "**":
                power: Number = 1.0
                for _ in range(int(value.value)):
                    power = self.mul(power, operands[0])
                return self.let(power)
            case "+" | "-" | "*" | "/" as sign:
                return {"+": self.add, "-": self.sub, "*": self.mul, "/": self.div}[sign](*operands)
            case name:
                return self.call(name, *operands)

    def _bare(self, value: Number) -> str:
        """Return a number as an argument."""
        return value.text if isinstance(value, Scalar) else self._notation.number(value)

    def _infix(self, sign: str, a: Number, b: Number, folded: Callable[[float, float], float]) -> Number:
        if not isinstance(a, Scalar) and not isinstance(b, Scalar):
            return folded(a, b)
        return Scalar(f"({self.text(a)} {sign} {self.text(b)})")

    def _variable(self, letter: str, form: str, value: str) -> str:
        """Return the variable for a value; declare it on first use."""
        if value not in self._variables:
            name = self._variables[value] = self._name(letter)
            self._steps.append((name, [form.format(name=name, value=value)]))
        return self._variables[value]

    def _name(self, letter: str) -> str:
        self._count += 1
        return f"{letter}{self._count}"


def output_count(function: Function) -> int:
    """Return how many scalars a network's outputs have: 1 of a value, 4 of a gradient and value, 3 of a color."""
    return {1: 1, 2: 4, 3: 3}[len(function.outputs)]
