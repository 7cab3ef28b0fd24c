"""Expressions in time: parsed, evaluated, bounded, and refused with a reason."""

import numpy as np
import pytest

from mplicits.model.errors import UserError
from mplicits.model.expression_reader import read

VALID = (
    ("30 * t", lambda t: 30 * t),
    ("-t ** 2 + 1", lambda t: -(t**2) + 1),
    ("2 - 3 - t", lambda t: 2 - 3 - t),
    ("8 / 2 / (1 + t)", lambda t: 8 / 2 / (1 + t)),
    ("sin(2 * pi * t) * cos(t)", lambda t: np.sin(2 * np.pi * t) * np.cos(t)),
    ("min(t, 0.5) + max(abs(t - 0.3), 1e-1)", lambda t: min(t, 0.5) + max(abs(t - 0.3), 0.1)),
    ("2 * -t", lambda t: -2 * t),
    (".5", lambda _: 0.5),
    (3, lambda _: 3),
)


@pytest.mark.parametrize(("text", "expected"), VALID)
def test_an_expression_has_python_s_value_within_its_range(text: object, expected: object) -> None:
    expression = read(text)
    low, high = expression.range()
    for time in np.linspace(0, 1, 57):
        value = expression.at(float(time))
        assert value == pytest.approx(expected(time))  # type: ignore[operator]
        assert low - 1e-9 <= value <= high + 1e-9
        assert read(str(expression)).at(float(time)) == pytest.approx(value)
        assert read(expression.written()).at(float(time)) == value


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1 / (t - 0.5)", "divides by zero at t = 0.5"),
        ("1 / (t - 1 / 3) ** 2", "divides by zero at t = 0.3333"),
        ("1 / (1 / (t + 1) - 0.5)", "divides by zero at t = 1"),
        ("t +", "the end is not expected"),
        ("(t", "the end is not expected"),
        ("1 2", "2 is not expected"),
        ("x + 1", "x is none of t, pi"),
        ("__import__", "is none of"),
        ("t.real", "is not allowed in"),
        ("2 ** t", "exponent"),
        ("1e7", "larger than"),
        ("(" * 500, "at most"),
        (True, "a number is needed"),
        (None, "a number is needed"),
        (float("nan"), "a number is needed"),
    ],
)
def test_an_invalid_expression_is_refused_in_one_line(text: object, said: str) -> None:
    with pytest.raises(UserError, match=said.replace("(", r"\(")) as caught:
        read(text)
    assert "\n" not in str(caught.value)
