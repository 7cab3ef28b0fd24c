"""A model as functions alone, in C-like languages that know vec4: what a program of one's own calls."""

import keyword
import re
from dataclasses import replace

from ...ir.prefixed import prefixed
from ...ir.program import Program
from ...model.errors import UserError
from ...model.files import show
from ...model.orientation import UPRIGHT
from .cstyle import Language
from .field import PLAIN, plain_colour
from .literal import LiteralStorage
from .scalars import Number, VectorNotation
from .unrolled import Unrolled

LONGEST = 40
"""Most characters of a name."""
_WORDS = """
abs array asm atan auto bool break buffer case cast centroid char clamp class color common const continue cos
default discard do double dot else enum export extern false filter final fixed flat float floor fn for fract
fragment function goto half hvec if in inline inout input int interface invariant layout let long main mat
matrix max min mix mod mul namespace new normalize null operator out output override packed partition pass patch
pixel pow precise precision private public ptr register resource restrict return round sample sampler self
shader shared short sign signed sin sizeof smooth sqrt static std storage string struct super switch tan
template texture this true type typedef uniform union unsigned using var varying vec vector vertex virtual void
volatile while workgroup
"""
WORDS = frozenset(_WORDS.split())
"""Words that mean something in one of the languages, in which no function has such a name."""

Place = tuple[tuple[float, float, float], float, str]
"""Centre, scale and upward axis of the space that a function takes points in (`Model.place`)."""


def function_name(name: str | None, model_name: str) -> str:
    """Return the name of the function: `name` where it can be one, or for None one made of the model's name.

    Raises UserError where `name` is no name in every language.
    """
    if name is None:
        made = re.sub("_+", "_", re.sub(r"[^a-z0-9]", "_", model_name.lower())).strip("_")[:LONGEST].strip("_")
        made = made if made[:1].isalpha() else f"sdf_{made}".strip("_")
        return f"{made}_sdf" if _is_taken(made) else made
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name or name.endswith("_") or len(name) > LONGEST:
        raise UserError(
            f"--name {show(name)}: a letter, then letters, digits and single _ between them, {LONGEST} at most"
        )
    if _is_taken(name):
        raise UserError(f"--name {name}: a word of one of the languages; choose another")
    return name


def _is_taken(name: str) -> bool:
    return (
        name in WORDS
        or keyword.iskeyword(name)
        or re.fullmatch(r"(float|vec|mat|int|uint|half)\d\w*", name) is not None
    )


def print_function(program: Program, language: Language, name: str, place: Place, sines: str) -> str:
    """Print a program as functions whose names begin with `name`, with its weights as constants.

    float NAME(vec3 p): the signed distance, of the finest level that is defined at p (Eq. 3), negative inside;
    float NAME_level(vec3 p, int level): the same with levels up to `level` alone, counted from 1;
    vec3 NAME_normal(vec3 p): the gradient of NAME, of length 1;
    vec3 NAME_color(vec3 p): the colour, sRGB.
    A field that moves takes a last parameter, `float time`. Points, distances and normals are in the space of `place`.

    sines: the text of glsl/sine.glsl, which is printed for the program's sines.
    """
    language = replace(language, sine=f"{name}_sine", cosine=f"{name}_cosine")
    program = prefixed(program, name)
    storage = LiteralStorage(program, language, program.functions())
    lines = [*storage.declarations(), "", *_sines(sines, language, name)]
    for function in program.functions():
        lines += ["", *storage.definition(function)]
    printer = (_Face if program.composition is None else _SceneFace)(program, language, name, place)
    for definition in (printer.inputs(), printer.level(), printer.whole(), printer.normal(), printer.colour()):
        lines += ["", *definition]
    return "\n".join(lines) + "\n"


def _sines(text: str, language: Language, name: str) -> list[str]:
    """Print the functions of glsl/sine.glsl, whose bodies are declarations and a result."""
    text = re.sub(r"\b(reduced|sine|cosine)\(", rf"{name}_\1(", text)
    lines = []
    for line in text.splitlines():
        if head := re.fullmatch(r"vec4 (\w+)\(vec4 x\) \{", line):
            lines.append(language.begin("vec4", head[1], language.taken(("vec4", "x"))))
        elif local := re.fullmatch(r"    vec4 (\w+) = (.*);", line):
            lines.append("    " + language.local("vec4", local[1], local[2]))
        elif not line.startswith("//"):
            lines.append(line)
    return lines


class _Face:
    """Prints the functions that users call."""

    def __init__(self, program: Program, language: Language, name: str, place: Place) -> None:
        self.program, self.language, self.name, self.place = program, language, name, place
        self.time = [("float", "time")] if program.moving else []
        self.passed = ", time" if program.moving else ""

    def _number(self, value: float) -> str:
        return self.language.number(value)

    def _vec3(self, *values: str) -> str:
        return f"{self.language.type('vec3')}({', '.join(values)})"

    def _begin(self, kind: str, name: str, *more: tuple[str, str]) -> str:
        return self.language.begin(kind, name, self.language.taken(("vec3", "p"), *more, *self.time))

    def inputs(self) -> list[str]:
        """Return the function that makes the networks' input of a point: in model space, and 1 or the time."""
        centre, scale, up = self.place
        turned = [_component(row, "p") for row in UPRIGHT[up]]
        parts = []
        for text, offset in zip(turned, centre, strict=True):
            moved = f"({text} - {self._number(offset)})" if offset else text
            parts.append(f"{moved} * {self._number(1 / scale)}" if scale != 1 else moved)
        fourth = "time" if self.program.moving else self._number(1.0)
        vec4 = self.language.type("vec4")
        return [self._begin("vec4", f"{self.name}_input"), f"    return {vec4}({', '.join(parts)}, {fourth});", "}"]

    def level(self) -> list[str]:
        """Return NAME_level: levels one inside the other, each where the one before is within its band."""
        lines = [
            self._begin("float", f"{self.name}_level", ("int", "level")),
            "    " + self._local("vec4", "q", f"{self.name}_input(p{self.passed})"),
            "    " + self._local("float", "f", f"{self.program.values[0].name}(q)"),
        ]
        for i, function in enumerate(self.program.values[1:], start=1):
            inside = f"abs(f) < {self._number(self.program.bands[i - 1].delta)}"
            lines += [f"{'    ' * i}if (level > {i} && {inside}) {{", f"{'    ' * i}    f += {function.name}(q);"]
        lines += ["    " * i + "}" for i in range(len(self.program.values) - 1, 0, -1)]
        return [*lines, *self._distance("f")]

    def _distance(self, value: str) -> list[str]:
        """Return the end of a function that gives a distance, which is in model units."""
        scale = self.place[1]
        return [f"    return {value}{f' * {self._number(scale)}' if scale != 1 else ''};", "}"]

    def whole(self) -> list[str]:
        """Return NAME: all levels."""
        return [
            self._begin("float", self.name),
            f"    return {self.name}_level(p, {len(self.program.bands)}{self.passed});",
            "}",
        ]

    def normal(self) -> list[str]:
        """Return NAME_normal."""
        lines = [
            self._begin("vec3", f"{self.name}_normal"),
            "    " + self._local("vec4", "q", f"{self.name}_input(p{self.passed})"),
            "    " + self._local("vec4", "g", f"{self.program.gradients[0].name}(q)"),
        ]
        for i, function in enumerate(self.program.gradients[1:], start=1):
            inside = f"abs(g.w) < {self._number(self.program.bands[i - 1].delta)}"
            lines += [f"{'    ' * i}if ({inside}) {{", f"{'    ' * i}    g += {function.name}(q);"]
        lines += ["    " * i + "}" for i in range(len(self.program.gradients) - 1, 0, -1)]
        return [*lines, *self._direction()]

    def _direction(self) -> list[str]:
        """Return the end of a function that gives the direction of g, which is in model space."""
        back = [_component(column, "g") for column in zip(*UPRIGHT[self.place[2]], strict=True)]
        return [f"    return normalize({self._vec3(*back)});", "}"]

    def colour(self) -> list[str]:
        """Return NAME_color."""
        lines = [self._begin("vec3", f"{self.name}_color")]
        if self.program.texture is None:
            return [*lines, f"    return {self._vec3(*PLAIN.split(', '))};", "}"]
        low, high = (self._vec3(*[self._number(value)] * 3) for value in (0.0, 1.0))
        called = f"{self.program.texture.name}({self.name}_input(p{self.passed}))"
        return [*lines, f"    return clamp({called}, {low}, {high});", "}"]

    def _local(self, kind: str, name: str, value: str) -> str:
        return self.language.local(kind, name, value)


class _SceneFace(_Face):
    """Prints them for a scene."""

    def level(self) -> list[str]:
        """Return NAME_level."""
        there = self._there(level="level")
        begin = self._begin("float", f"{self.name}_level", ("int", "level"))
        return [begin, *self._body(there, there.value), *self._distance(there.text(there.value))]

    def normal(self) -> list[str]:
        """Return NAME_normal."""
        there = self._there()
        gradient = there.gradient()
        local = self._local("vec3", "g", self._vec3(*map(there.text, gradient)))
        return [
            self._begin("vec3", f"{self.name}_normal"),
            *self._body(there, *gradient),
            f"    {local}",
            *self._direction(),
        ]

    def colour(self) -> list[str]:
        """Return NAME_color."""
        there = self._there()
        colour = there.colour(plain_colour())
        result = f"    return {self._vec3(*map(there.text, colour))};"
        return [self._begin("vec3", f"{self.name}_color"), *self._body(there, *colour), result, "}"]

    def _there(self, level: str | None = None) -> Unrolled:
        notation = VectorNotation(self.language)
        return Unrolled(self.program, notation, ("q.x", "q.y", "q.z"), level=level)

    def _body(self, there: Unrolled, *results: Number) -> list[str]:
        """Return the point in model space, and the lines that some numbers need."""
        point = self._local("vec4", "q", f"{self.name}_input(p{self.passed})")
        return [f"    {line}" for line in (point, *there.lines(*results))]


def _component(row: tuple[float, ...], vector: str) -> str:
    """Return the component that a row of a rotation by right angles takes from a vector: `-p.y` for (0, -1, 0)."""
    (k,) = (k for k, value in enumerate(row) if value)
    return f"{'-' if row[k] < 0 else ''}{vector}.{'xyz'[k]}"
