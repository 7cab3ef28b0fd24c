"""Expressions in the time t, such as "30 * t" in a scene: their values, and bounds over all times."""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .files import show

FUNCTIONS = {"sin": 1, "cos": 1, "abs": 1, "min": 2, "max": 2}
"""Name of a function -> number of arguments. Angles are in radians."""
LARGEST = 1e6
"""Largest absolute value of an expression."""
TINY, HUGE = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
"""Smallest positive and largest number that a target, which counts in float32, can say."""
CELLS, REFINED, DEPTH = 1024, 16, 5
"""Intervals of [0, 1] for interval arithmetic; parts of a subdivided interval; largest depth of subdivision."""

Values = NDArray[np.float64]
Range = tuple[Values, Values]
"""Lower and upper bounds, one for each interval of time."""


@dataclass(frozen=True)
class Expression:
    """A number that may depend on the time t, from 0 to 1."""

    kind: str
    """"number", "t", "negative", one of + - * / **, or one of `FUNCTIONS`."""
    value: float = 0.0
    """Value of a number, or exponent of a power, from 0 to 9."""
    operands: "tuple[Expression, ...]" = ()
    """Operands of the operator, or arguments of the function."""
    text: str = field(default="", compare=False)
    """Source text; empty in subexpressions."""

    @property
    def moves(self) -> bool:
        """Whether the expression contains t."""
        return self.kind == "t" or any(operand.moves for operand in self.operands)

    def at(self, time: float) -> float:
        """Evaluate the expression."""
        if self.kind in ("number", "t"):
            return self.value if self.kind == "number" else time
        values = [operand.at(time) for operand in self.operands]
        return float(values[0] ** int(self.value) if self.kind == "**" else APPLIED[self.kind](*values))

    def written(self) -> float | str:
        """Return the input of `read` for this expression: a number if it is constant, else a text."""
        return self.text or str(self) if self.moves else self.at(0.0)

    def __str__(self) -> str:
        """Write the expression with all brackets."""
        match self.kind:
            case "number":
                return repr(self.value)
            case "t":
                return "t"
            case "negative":
                return f"(-{self.operands[0]})"
            case "**":
                return f"({self.operands[0]} ** {int(self.value)})"
            case kind if kind in FUNCTIONS:
                return f"{kind}({', '.join(map(str, self.operands))})"
            case kind:
                return f"({self.operands[0]} {kind} {self.operands[1]})"

    def range(self) -> tuple[float, float]:
        """Bound the values for t in [0, 1] by interval arithmetic.

        Raises UserError if a denominator is zero at some time, if a number on the way is none of float32, or if the
        bounds exceed `LARGEST`.
        """
        edges = np.linspace(0, 1, CELLS + 1)
        with np.errstate(all="ignore"):
            low, high = self._checked_range((edges[:-1], edges[1:]))
        least, most = float(low.min()), float(high.max())
        if not (least >= -LARGEST and most <= LARGEST):
            raise UserError(f"{show(str(self))} is larger than {LARGEST:,.0f} at some t of [0, 1]")
        return least, most

    def _checked_range(self, times: Range) -> Range:
        """Bound the values as `_range`, and check this expression and those in it, innermost first; each once.

        Raises UserError where float32 cannot say the values at these times: they are too large, or all but zero.
        """
        ranges = [operand._checked_range(times) for operand in self.operands]
        if self.kind == "/":
            self._check_division(times)
        low, high = self._of_ranges(ranges, times)
        size = float(np.maximum(np.abs(low), np.abs(high)).max())
        if not (size == 0 or TINY <= size <= HUGE):
            raise UserError(f"{show(str(self))} is too {'small' if size < TINY else 'large'} for 32 bits")
        return low, high

    def _check_division(self, times: Range) -> None:
        """Raise UserError if the denominator may be zero at one of the times."""
        denominator = self.operands[1]
        for depth in range(DEPTH):
            with np.errstate(all="ignore"):
                low, high = denominator._range(times)
            doubtful = np.flatnonzero(~((low >= TINY) | (high <= -TINY)))
            if not len(doubtful):
                return
            start, end = times[0][doubtful], times[1][doubtful]
            if depth == DEPTH - 1 or len(doubtful) > CELLS:
                raise UserError(f"{show(str(denominator))} divides by zero at t = {(start[0] + end[0]) / 2:.4g}")
            cuts = start[:, None] + (end - start)[:, None] * np.linspace(0, 1, REFINED + 1)
            times = cuts[:, :-1].ravel(), cuts[:, 1:].ravel()

    def _range(self, times: Range) -> Range:
        """Bound the values in each interval of time."""
        return self._of_ranges([operand._range(times) for operand in self.operands], times)

    def _of_ranges(self, ranges: list[Range], times: Range) -> Range:
        """Bound the values in each interval of time by the ranges of the operands."""
        if self.kind == "number":
            return np.full_like(times[0], self.value), np.full_like(times[0], self.value)
        if self.kind == "t":
            return times
        return _power(ranges[0], self.value) if self.kind == "**" else RANGES[self.kind](*ranges)


def _waves(low: Values, high: Values, phase: float) -> Range:
    """Bound sin(x + phase) for x from low to high."""
    ends = np.stack([np.sin(low + phase), np.sin(high + phase)])
    crest = np.floor((high + phase) / (2 * np.pi) - 0.25) >= np.ceil((low + phase) / (2 * np.pi) - 0.25)
    trough = np.floor((high + phase) / (2 * np.pi) + 0.25) >= np.ceil((low + phase) / (2 * np.pi) + 0.25)
    return np.where(trough, -1, ends.min(axis=0)), np.where(crest, 1, ends.max(axis=0))


def _products(a: Range, b: Range) -> Range:
    products = np.stack([x * y for x in a for y in b])
    return products.min(axis=0), products.max(axis=0)


def _power(base: Range, exponent: float) -> Range:
    low, high = base
    powers = np.stack([low**exponent, high**exponent])
    even = exponent % 2 == 0 and exponent > 0
    return np.where((low < 0) & (high > 0) & even, 0, powers.min(axis=0)), powers.max(axis=0)


def _size(a: Range) -> Range:
    ends = np.stack([np.abs(a[0]), np.abs(a[1])])
    return np.where((a[0] <= 0) & (a[1] >= 0), 0, ends.min(axis=0)), ends.max(axis=0)


APPLIED: dict[str, Callable[..., float]] = {
    "negative": operator.neg,
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "min": min,
    "max": max,
}
"""Kind of an expression -> function from the values of its operands to its value."""
RANGES: dict[str, Callable[..., Range]] = {
    "negative": lambda a: (-a[1], -a[0]),
    "+": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "-": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "*": _products,
    "/": lambda a, b: _products(a, (1 / b[1], 1 / b[0])),
    "sin": lambda a: _waves(a[0], a[1], 0.0),
    "cos": lambda a: _waves(a[0], a[1], math.pi / 2),
    "abs": _size,
    "min": lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    "max": lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
}
"""Kind of an expression -> function from the ranges of its operands to its range."""


def number(value: float) -> Expression:
    """Return a number as an expression."""
    return Expression("number", float(value))


ZERO, ONE, TIME = number(0), number(1), Expression("t")
"""Defaults of a scene's numbers."""


def product(*factors: Expression) -> Expression:
    """Return the product of expressions; a number if all are constant."""
    whole = number(math.prod(factor.at(0.0) for factor in factors if not factor.moves))
    for factor in factors:
        if factor.moves:
            whole = factor if whole == number(1.0) else Expression("*", operands=(whole, factor))
    return whole
