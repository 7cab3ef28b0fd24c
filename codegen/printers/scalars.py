"""Numbers in generated text, one after another and without vectors, which every language has; unrolled.py uses them."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from ...ir.program import Function
from ...model.expression import Expression
from .cstyle import Language


@dataclass(frozen=True)
class Scalar:
    """A number that is known when the text runs."""

    text: str
    """An expression that may be an operand as it is."""


Number = float | Scalar
"""One that is known while printing is a float, which all of `Writer` folds."""
FOLDED: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "min": min,
    "max": max,
}
"""Functions of scalars by name, of floats."""

_WORD = re.compile(r"[A-Za-z_]\w*")


class Notation(Protocol):
    """How a language writes scalars."""

    functions: Mapping[str, str]
    """Name in `FOLDED` -> a format with {0}, {1}, ... for the arguments."""
    pick: str
    """A format with {condition}, {yes} and {no}."""
    both: str
    """Two conditions, {0} and {1}, joined."""
    let: str
    """A new local variable, a format with {name} and {value}."""
    holds: str
    """The same of a condition."""

    def number(self, value: float) -> str:
        """Return a literal."""

    def ask(self, name: str, function: Function, inputs: tuple[str, str, str, str], condition: str) -> list[str]:
        """Return lines that call a function of a program where a condition holds: its outputs are zero elsewhere."""

    def output(self, name: str, function: Function, k: int) -> str:
        """Return the k-th of the outputs that `ask` has under a name: of a gradient x, y, z, value."""


class VectorNotation:
    """Of the languages that know vec4."""

    both = "{0} && {1}"

    def __init__(self, language: Language) -> None:
        self._language = language
        self.pick = language.pick
        self.let, self.holds = (language.local(kind, "{name}", "{value}") for kind in ("float", "bool"))
        four = language.type("vec4")
        # A sine of the text's own takes a vec4, a built-in one takes a number, too.
        waves = {
            name: f"{name}({{0}})" if wave == name else f"{wave}({four}({{0}})).x"
            for name, wave in (("sin", language.sine), ("cos", language.cosine))
        }
        simple = {name: f"{name}({{0}})" for name in ("sqrt", "abs")}
        self.functions: Mapping[str, str] = {**simple, **waves, "min": "min({0}, {1})", "max": "max({0}, {1})"}

    def number(self, value: float) -> str:
        """Return a literal."""
        return self._language.number(value)

    def ask(self, name: str, function: Function, inputs: tuple[str, str, str, str], condition: str) -> list[str]:
        """Return lines that call a function where a condition holds."""
        kind = {1: "float", 2: "vec4", 3: "vec3"}[len(function.outputs)]
        zero, four = self.number(0), self._language.type("vec4")
        nothing = zero if kind == "float" else f"{self._language.type(kind)}({', '.join([zero] * int(kind[3]))})"
        call = f"{function.name}({four}({', '.join(inputs)}))"
        return [self._language.local(kind, name, nothing), f"if ({condition}) {{ {name} = {call}; }}"]

    def output(self, name: str, function: Function, k: int) -> str:
        """Return a component."""
        if len(function.outputs) == 1:
            return name
        # CUDA's vec4 has the members xyz and w alone.
        return f"{name}.w" if k == 3 else f"{name}{'.xyz' if len(function.outputs) == 2 else ''}.{'xyz'[k]}"


class Writer:
    """Lines that compute scalars."""

    def __init__(self, notation: Notation, time: str) -> None:
        """Begin without lines. time: the variable that holds t."""
        self._steps: list[tuple[str, list[str]]] = []
        self._variables: dict[str, str] = {}
        self._notation, self._time, self._count = notation, time, 0

    def lines(self, *results: Number) -> list[str]:
        """Return the lines that some numbers need."""
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
        """Give a number a variable of its own."""
        if not isinstance(value, Scalar) or value.text.isidentifier():
            return value
        return Scalar(self._variable("a", self._notation.let, value.text))

    def holds(self, condition: str) -> str:
        """Give a condition a variable."""
        return self._variable("c", self._notation.holds, condition)

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

    def call(self, name: str, *values: Number) -> Number:
        """Return what one of `FOLDED` gives."""
        known = [value for value in values if not isinstance(value, Scalar)]
        if len(known) == len(values):
            return float(FOLDED[name](*known))
        return Scalar(self._notation.functions[name].format(*(self._bare(value) for value in values)))

    def clamped(self, value: Number) -> Number:
        """Return a number brought into [0, 1]."""
        return self.call("min", self.call("max", value, 0.0), 1.0)

    def less(self, a: Number, b: Number) -> str:
        """Return the condition a < b."""
        return f"({self.text(a)} < {self.text(b)})"

    def both(self, a: str, b: str) -> str:
        """Return the condition that two conditions hold."""
        return f"({self._notation.both.format(a, b)})"

    def pick(self, condition: str, yes: Number, no: Number) -> Number:
        """Return one of two numbers."""
        return Scalar(self._notation.pick.format(condition=condition, yes=self.text(yes), no=self.text(no)))

    def ask(self, function: Function, inputs: "tuple[Number, ...]", condition: str) -> list[Number]:
        """Return the outputs of a program's function at (x, y, z, w) where a condition holds, and zeros elsewhere."""
        x, y, z, w = map(self._bare, inputs)
        name = self._name("r")
        self._steps.append((name, self._notation.ask(name, function, (x, y, z, w), condition)))
        count = {1: 1, 2: 4, 3: 3}[len(function.outputs)]
        return [Scalar(self._notation.output(name, function, k)) for k in range(count)]

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
        """Return the variable that has a value, which is made where there is none."""
        if value not in self._variables:
            name = self._variables[value] = self._name(letter)
            self._steps.append((name, [form.format(name=name, value=value)]))
        return self._variables[value]

    def _name(self, letter: str) -> str:
        self._count += 1
        return f"{letter}{self._count}"
