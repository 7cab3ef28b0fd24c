"""Prints NAME_trace, which intersects one ray with the surface, as field/trace.py does for many."""

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from ...ir.program import Program
from ...model.orientation import as_in_file
from .user_functions import FunctionLanguage, Place

NEAR = 1e-6
"""Largest field at which a ray has reached the surface, model units."""
LEAST = 2e-4
"""Smallest step, model units."""
STEPS = 1000
"""Largest number of steps of a ray."""
REFINEMENTS = 3
"""Steps of bisection, and as many of false position, after a step that entered the shape."""


class TracingLanguage(FunctionLanguage):
    """How a language writes NAME_trace."""

    vector: str
    """A point of the components {0}, {1} and {2}."""
    loop: str
    """First line of a loop that runs {count} times."""

    @abstractmethod
    def results(self, name: str, values: Sequence[str]) -> list[str]:
        """Return the lines that store a float or a vector in a result."""

    @abstractmethod
    def store_normal(self, name: str, arguments: str) -> list[str]:
        """Return the lines that store NAME_normal(arguments) in the result `normal`."""

    @abstractmethod
    def trace_head(self, name: str, parameters: Sequence[tuple[str, str]]) -> list[str]:
        """Return the lines up to the body. parameters (type, name): those before the results t and normal."""


def print_trace(program: Program, language: TracingLanguage, name: str, place: Place) -> list[str]:
    """Return the lines of NAME_trace(origin, direction, t, normal), in the space of `place`.

    It returns whether the ray origin + t direction, t >= 0, meets the surface, and where it does t and the normal;
    elsewhere both are 0. direction: any length but 0. It calls NAME_step, the distance that a ray may go from a point,
    and NAME_normal.
    """
    center, scale, up = place
    n, call = language.number, language.functions
    origin, direction = ([c.replace("p", word, 1) for c in language.point] for word in ("origin", "direction"))
    middle = as_in_file(np.array(center), up)
    offset = [f"{o} - {n(c)}" if c > 0 else f"{o} + {n(-c)}" if c else o for o, c in zip(origin, middle, strict=True)]
    ray, apart, nearest = ([f"{letter}{axis}" for axis in "xyz"] for letter in "dac")
    time = [("float", "time")] if program.moving else []

    def lets(names: Sequence[str], values: Sequence[str]) -> list[str]:
        return [_let(language, *pair) for pair in zip(names, values, strict=True)]

    def step(t: str) -> str:
        return f"{name}_step({at(t)})"

    def narrow(point: str) -> list[str]:
        """Return the lines that move an end of the interval (before, after) to a point in it."""
        return [
            f"        here = {point};",
            f"        found = {step('here')};",
            f"        if (found > {n(0)}) {{ before = here; space = found; }} else {{ after = here; room = found; }}",
        ]

    def at(t: str) -> str:
        place = language.vector.format(*(f"{o} + {t} * {d}" for o, d in zip(origin, ray, strict=True)))
        return ", ".join([place, *(entry for _, entry in time)])

    body = [
        *language.results("t", [n(0)]),
        *language.results("normal", [n(0)] * 3),
        _let(language, "unit", call["sqrt"].format(_dot(direction, direction))),
        *lets(ray, [f"{d} / unit" for d in direction]),
        "// The ball around the shape.",
        *lets(apart, offset),
        _let(language, "along", _dot(apart, ray)),
        *lets(nearest, [f"{a} - along * {d}" for a, d in zip(apart, ray, strict=True)]),
        _let(language, "inside", f"{n((scale * (1 + program.bands[-1].delta)) ** 2)} - ({_dot(nearest, nearest)})"),
        f"if (inside <= {n(0)}) {{ return false; }}",
        _let(language, "chord", call["sqrt"].format("inside")),
        _let(language, "here", call["max"].format("-along - chord", n(0))),
        *lets(["before", "room", "space"], ["here", n(0), n(0)]),
        language.loop.format(count=STEPS),
        "    if (here > chord - along) { return false; }",
        f"    room = {step('here')};",
        f"    if (room < {n(scale * NEAR)}) {{ break; }}",
        "    before = here; space = room;",
        f"    here += {call['max'].format('room', n(scale * LEAST))};",
        "}",
        f"if (room >= {n(scale * NEAR)}) {{ return false; }}",
        "// A step entered the shape: bisection and false position.",
        f"if (room < {n(0)} && here > before) {{",
        f"    {_let(language, 'after', 'here')}",
        f"    {_let(language, 'found', n(0))}",
        f"    {language.loop.format(count=REFINEMENTS)}",
        *narrow(f"{n(0.5)} * (before + after)"),
        *narrow("before + (after - before) * space / (space - room)"),
        "    }",
        "}",
        *language.results("t", ["here / unit"]),
        *language.store_normal(name, at("here")),
        "return true;",
    ]
    head = language.trace_head(f"{name}_trace", [("vec3", "origin"), ("vec3", "direction"), *time])
    return ["", *head, *(f"    {line}" for line in body), "}"]


def _let(language: TracingLanguage, name: str, value: str) -> str:
    """Return the declaration of a float."""
    return language.let.format(name=name, value=value)


def _dot(first: Sequence[str], second: Sequence[str]) -> str:
    """Return a sum of products."""
    return " + ".join(f"{a} * {b}" for a, b in zip(first, second, strict=True))
