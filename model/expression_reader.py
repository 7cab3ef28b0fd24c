"""A parser of expressions in time (model/expression.py). It never runs them as code.

sum      = product (("+" | "-") product)*
product  = factor (("*" | "/") factor)*
factor   = "-" factor | power
power    = atom ("**" digit)?
atom     = number | "t" | "pi" | "(" sum ")" | name "(" sum ("," sum)* ")"
"""

import math
import re
from dataclasses import replace
from typing import Any

from .errors import UserError
from .expression import FUNCTIONS, LARGEST, Expression, number
from .files import show

LONGEST = 120
"""Largest number of characters of an expression; it bounds the depth of nesting."""

_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([A-Za-z_]\w*)|(\*\*|[-+*/(),]))")


def read(value: Any) -> Expression:
    """Parse a number or a text, and check it for all t in [0, 1]. Raises UserError."""
    if isinstance(value, str):
        if len(value) > LONGEST:
            raise UserError(f"an expression has at most {LONGEST} characters")
        expression = replace(_Parser(value).whole(), text=value)
    elif isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= LARGEST:
        raise UserError("a number is needed, or an expression in t as a text")
    else:
        expression = number(value)
    expression.range()
    return expression if expression.moves else number(expression.at(0.0))


class _Parser:
    """Parses one text by recursive descent."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0
        self._tokens: list[str] = []
        while text[self._at :].strip():
            match = _TOKEN.match(text, self._at)
            if match is None:
                raise UserError(f"{show(text)}: {show(text[self._at :].strip()[:1])} is not allowed in an expression")
            self._tokens.append(match[0].strip())
            self._at = match.end()
        self._at = 0

    def whole(self) -> Expression:
        """Parse the whole text."""
        expression = self._sum()
        if self._at < len(self._tokens):
            raise self._unexpected()
        return expression

    def _unexpected(self) -> UserError:
        what = show(self._tokens[self._at]) if self._at < len(self._tokens) else "the end"
        return UserError(f"{show(self._text)}: {what} is not expected here")

    def _take(self, *choices: str) -> str | None:
        """Take the next token if it is one of `choices`; else return None."""
        if self._at < len(self._tokens) and self._tokens[self._at] in choices:
            self._at += 1
            return self._tokens[self._at - 1]
        return None

    def _expect(self, token: str) -> None:
        if self._take(token) is None:
            raise self._unexpected()

    def _sum(self) -> Expression:
        left = self._product()
        while (sign := self._take("+", "-")) is not None:
            left = Expression(sign, operands=(left, self._product()))
        return left

    def _product(self) -> Expression:
        left = self._factor()
        while (sign := self._take("*", "/")) is not None:
            left = Expression(sign, operands=(left, self._factor()))
        return left

    def _factor(self) -> Expression:
        if self._take("-") is not None:
            return Expression("negative", operands=(self._factor(),))
        base = self._atom()
        if self._take("**") is None:
            return base
        exponent = self._next()
        if not re.fullmatch("[0-9]", exponent):
            raise UserError(f"{show(self._text)}: the exponent of ** is a digit from 0 to 9")
        return Expression("**", float(exponent), (base,))

    def _next(self) -> str:
        if self._at == len(self._tokens):
            raise self._unexpected()
        self._at += 1
        return self._tokens[self._at - 1]

    def _atom(self) -> Expression:
        token = self._next()
        if token == "(":
            inside = self._sum()
            self._expect(")")
            return inside
        if token[0].isdecimal() or token[0] == ".":
            return number(float(token))
        if token == "t":
            return Expression("t")
        if token == "pi":
            return number(math.pi)
        if token not in FUNCTIONS:
            self._at -= 1
            if token.isidentifier():
                raise UserError(f"{show(self._text)}: {show(token)} is none of t, pi, {', '.join(FUNCTIONS)}")
            raise self._unexpected()
        self._expect("(")
        arguments = [self._sum()]
        for _ in range(FUNCTIONS[token] - 1):
            self._expect(",")
            arguments.append(self._sum())
        self._expect(")")
        return Expression(token, operands=tuple(arguments))
