"""Prints a model as functions for a user's own program, in any language (`FunctionLanguage`)."""

from abc import abstractmethod
from collections.abc import Sequence

from ...ir.lower_scene import prefixed
from ...ir.program import Function, Program
from ...model.model import DELTA_FACTOR
from ...model.orientation import UPRIGHT
from .field import plain_color
from .scalars import Notation, Number, Scalar, Triple, Writer
from .scene_scalars import SceneAtPoint

Place = tuple[tuple[float, float, float], float, str]
"""Center, scale and upward axis of the space in which a function takes points (`Model.place`)."""


class FunctionLanguage(Notation):
    """How a language writes a model's networks and the functions that a user calls."""

    comment = "//"
    """Start of a comment line."""
    private = ""
    """Prefix of names that a user does not call."""
    point: tuple[str, str, str]
    """Components of the point inside a function."""
    opening: Sequence[str] = ()
    """Lines before the weights."""

    @abstractmethod
    def networks(self, program: Program) -> list[str]:
        """Return the weights, and a function for each network."""

    @abstractmethod
    def function(
        self, kind: str, name: str, parameters: Sequence[tuple[str, str]], lines: list[str], results: list[str]
    ) -> list[str]:
        """Return a function of a point p and further parameters (type, name).

        kind: type of the result, float or vec3. lines: the body, without indentation. results: the components of the
        result.
        """


def print_user_functions(
    program: Program, language: FunctionLanguage, name: str, place: Place, step: bool = False
) -> list[str]:
    """Return the lines of a program's weights, networks and these four functions, in the space of `place`.

    NAME_level(p, level): signed distance with only the levels 1 to `level`, negative inside;
    NAME(p): signed distance with all levels;
    NAME_normal(p): gradient of NAME, normalized;
    NAME_color(p): color, sRGB.
    step: also NAME_step(p), how far a ray may go from p: negative inside; by the finest level that is defined at p.
    A moving field has a last parameter, `float time`.
    """
    program = prefixed(program, language.private + name)
    _, scale, up = place
    time = [("float", "time")] if program.moving else []

    def at_point(level: str | None = None) -> "tuple[Writer, SceneAtPoint | _ShapeAtPoint]":
        writer = Writer(language)
        at_point = _ShapeAtPoint if program.composition is None else SceneAtPoint
        return writer, at_point(program, writer, _in_model_space(writer, language.point, place), level)

    def function(kind: str, suffix: str, writer: Writer, *results: Number, level: bool = False) -> list[str]:
        parameters = [("int", "level"), *time] if level else time
        texts = [writer.text(result) for result in results]
        return ["", *language.function(kind, name + suffix, parameters, writer.lines(*results), texts)]

    lines = language.networks(program)
    writer, field = at_point("level")
    lines += function("float", "_level", writer, writer.mul(field.value, scale), level=True)
    whole = Scalar(f"{name}_level(p, {len(program.bands)}{', time' if time else ''})")
    lines += function("float", "", Writer(language), whole)
    writer, field = at_point()
    gradient = field.gradient()
    x, y, z = (_component(writer, column, gradient) for column in zip(*UPRIGHT[up], strict=True))
    length = writer.let(writer.call("sqrt", writer.dot((x, y, z), (x, y, z))))
    lines += function("vec3", "_normal", writer, *(writer.div(a, length) for a in (x, y, z)))
    writer, field = at_point()
    lines += function("vec3", "_color", writer, *field.color(plain_color()))
    if step:
        writer, field = at_point()
        lines += function("float", "_step", writer, writer.mul(_free_radius(program, writer, field), scale))
    return lines


def _free_radius(program: Program, writer: Writer, field: "_ShapeAtPoint | SceneAtPoint") -> Number:
    """Return the radius of a sphere around a point without surface, model units: free_radius() of march.glsl."""
    *coarser, finest = program.bands
    value = field.value
    radius = writer.mul(value, finest.step_bound)
    for condition, band in reversed(list(zip(field.defined, coarser, strict=True))):
        outside = writer.mul(writer.sub(value, band.delta / DELTA_FACTOR), band.band_step_bound)
        radius = writer.let(writer.pick(condition, radius, outside))
    return radius


class _ShapeAtPoint:
    """A shape's field, gradient and color at one point: the interface of `SceneAtPoint`."""

    def __init__(self, program: Program, writer: Writer, point: Triple, level: str | None) -> None:
        self._program, self._w, self._level = program, writer, level
        self._inputs = (*point, Scalar("time") if program.moving else 1.0)
        self.defined: list[str] = []
        """Where `value` has been written: the conditions on which level 2 and each further one is defined."""

    @property
    def value(self) -> Number:
        """The field."""
        return self._sum(self._program.values)[-1]

    def gradient(self) -> Triple:
        """Return the gradient of the field."""
        x, y, z, _ = self._sum(self._program.gradients)
        return x, y, z

    def color(self, plain: tuple[float, float, float]) -> Triple:
        """Return the color, sRGB; `plain` without a texture."""
        if self._program.texture is None:
            return plain
        r, g, b = map(self._w.clamped, self._w.network(self._program.texture, self._inputs))
        return r, g, b

    def _sum(self, functions: tuple[Function, ...]) -> list[Number]:
        """Add the networks' outputs, level by level (Eq. 3). The last output is the field."""
        w, condition = self._w, None
        self.defined = []
        total = w.network(functions[0], self._inputs)
        for i, (function, band) in enumerate(zip(functions[1:], self._program.bands, strict=False), start=1):
            inside = w.less(w.call("abs", total[-1]), band.delta)
            inside = w.both(f"({self._level} > {i})", inside) if self._level else inside
            condition = w.let_condition(w.both(condition, inside) if condition else inside)
            self.defined.append(condition)
            residuals = w.network(function, self._inputs, condition)
            total = [w.let(w.add(a, b)) for a, b in zip(total, residuals, strict=True)]
        return total


def _in_model_space(writer: Writer, point: tuple[str, str, str], place: Place) -> Triple:
    """Move a point from the space of `place` to model space."""
    center, scale, up = place
    p: Triple = Scalar(point[0]), Scalar(point[1]), Scalar(point[2])
    upright = (_component(writer, row, p) for row in UPRIGHT[up])
    x, y, z = (
        writer.let(writer.mul(writer.sub(a, offset), 1 / scale)) for a, offset in zip(upright, center, strict=True)
    )
    return x, y, z


def _component(writer: Writer, row: tuple[float, ...], vector: Triple) -> Number:
    """Return the component of a vector that a row of a rotation by right angles selects."""
    (k,) = (k for k, value in enumerate(row) if value)
    return writer.sub(0.0, vector[k]) if row[k] < 0 else vector[k]
