"""Evaluates scenes in NumPy, as ir/composition.py defines them; interpret.py calls it for programs of scenes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from ..ir.composition import Composition, Join, Leaf
from ..ir.program import Array, Program
from ..model.model import DELTA_FACTOR
from ..model.scene import DIFFERENCE, SMOOTH_UNION, UNION, Disc
from .run import Margins, run

Values = NDArray[np.float64]


@dataclass(eq=False)
class _LeafAtPoints:
    """The values of a leaf at points."""

    leaf: Leaf[Program]
    turn: Values
    """(3, 3), from directions of the leaf's space to the scene's."""
    scale: float
    """Length of the leaf's unit in the scene."""
    points: Values
    """(N, 3) in the leaf's space."""
    far: Values
    """(N,) distances of the points from the leaf's origin."""
    inputs: Array
    """(N, 4) inputs of the leaf's networks."""
    here: NDArray[np.bool_]
    """(N,) whether the next level is defined."""
    f: Values
    """(N,) value of the finest level so far, in the leaf's unit, at the point or at the nearest point of the unit
    ball."""

    @classmethod
    def at(cls, leaf: Leaf[Program], points: Array, time: float) -> "_LeafAtPoints":
        """Transform points (N, 3) into the leaf's space."""
        turn, scale, placed = np.eye(3), 1.0, points.astype(np.float64)
        for place in leaf.places:
            own, factor = _turn(place.axis, radians(place.angle.at(time))), place.scale.at(time)
            placed = (placed - [value.at(time) for value in place.translate]) @ own / factor
            turn, scale = turn @ own, scale * factor
        far = np.linalg.norm(placed, axis=1)
        inside = (placed / np.maximum(far, 1)[:, None]).astype(np.float32)
        fourth = leaf.time.at(time) if isinstance(leaf.part, Program) and leaf.part.moving else 1.0
        inputs = np.concatenate([inside, np.full((len(points), 1), fourth, np.float32)], axis=1)
        here = far < 1 + leaf.margin.at(time) if isinstance(leaf.part, Program) else np.zeros(len(points), np.bool_)
        return cls(leaf, turn, scale, placed, far, inputs, here, np.zeros(len(points)))

    def refine(self, level: int) -> None:
        """Add the residual of a level where that level is defined."""
        if not isinstance(self.leaf.part, Program) or level > len(self.leaf.part.values):
            return
        faded = np.ones(len(self.f))
        if level > 1:
            delta = self.leaf.part.bands[level - 2].delta
            self.here &= np.abs(self.f) < delta
            faded = _fade(self.f, delta)
        there = np.flatnonzero(self.here)
        (residual,) = run(self.leaf.part, self.leaf.part.values[level - 1], self.inputs[there])
        self.f[there] += faded[there] * residual[:, 0]

    def value(self, time: float) -> Values:
        if isinstance(self.leaf.part, Disc):
            return self.scale * _disc(self.leaf.part, self.points)[0]
        outside = self.far - 1
        bounded = np.where(outside > 0, np.hypot(outside, np.maximum(self.f, 0)), self.f)
        return self.scale * np.where(self.far < 1 + self.leaf.margin.at(time), bounded, outside)

    def only(self, chosen: NDArray[np.intp]) -> "_LeafAtPoints":
        return replace(
            self,
            points=self.points[chosen],
            far=self.far[chosen],
            inputs=self.inputs[chosen],
            here=self.here[chosen],
            f=self.f[chosen],
        )

    def gradient(self, level: int) -> Values:
        """Return the gradient (N, 3) of the value of a level, in the scene's space."""
        if isinstance(self.leaf.part, Disc):
            return _disc(self.leaf.part, self.points)[1] @ self.turn.T
        part = self.leaf.part
        near = np.flatnonzero(self.here)
        outwards = self.points / np.maximum(self.far, 1e-12)[:, None]
        result = outwards.copy()
        f, total, here = np.zeros(len(near)), np.zeros((len(near), 3)), np.ones(len(near), np.bool_)
        for i, function in enumerate(part.gradients[:level]):
            faded, slope = np.ones(len(f)), np.zeros(len(f))
            if i > 0:
                delta = part.bands[i - 1].delta
                here &= np.abs(f) < delta
                faded = _fade(f, delta)
                slope = np.where(faded < 1, -np.sign(f) / (delta - delta / DELTA_FACTOR), 0.0)
            gradient, residual = (value.astype(np.float64) for value in run(part, function, self.inputs[near]))
            change = (slope * residual[:, 0])[:, None] * total + faded[:, None] * gradient[:, :3]
            total = total + np.where(here[:, None], change, 0)
            f = f + np.where(here, faded * residual[:, 0], 0)
        outside, up = self.far[near] - 1, outwards[near]
        along = (total - (total * up).sum(axis=1)[:, None] * up) / self.far[near, None].clip(1)
        bounded = np.hypot(outside, np.maximum(f, 0)).clip(1e-12)[:, None]
        beyond = (outside[:, None] * up + np.maximum(f, 0)[:, None] * along) / bounded
        result[near] = np.where(outside[:, None] > 0, beyond, total)
        return result @ self.turn.T

    def color(self) -> Values | None:
        """Return the color (N, 3), sRGB in [0, 1]; None for a shape without colors."""
        if isinstance(self.leaf.part, Disc):
            return np.tile(self.leaf.part.color, (len(self.f), 1))
        if self.leaf.part.texture is None:
            return None
        channels = run(self.leaf.part, self.leaf.part.texture, self.inputs)
        return np.clip(np.concatenate(channels, axis=1), 0, 1).astype(np.float64)


def nested_levels(
    program: Program, points: Array, level: int, time: float, margins: Margins | None = None
) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """See interpret.nested_levels."""
    for defined, _, value in _levels(program, points, level, time, margins):
        yield defined, value.astype(np.float32)


def field(program: Program, points: Array, level: int, time: float) -> Array:
    """See interpret.field."""
    everywhere = [np.inf] * len(program.bands)
    *_, (_, _, value) = _levels(program, points, level, time, everywhere)
    return value.astype(np.float32)


def field_gradient(program: Program, points: Array, level: int, time: float) -> tuple[Array, Array]:
    """Evaluate the gradient of the nested field up to `level`, (N, 3) float32, and its value (N,)."""
    composition = _composition(program)
    gradient, value = np.zeros((len(points), 3)), np.zeros(len(points))
    reached = np.zeros(len(points), np.int64)
    shares = np.zeros((len(composition.leaves), len(points)))
    for number, (defined, leaves, f) in enumerate(_levels(program, points, level, time), start=1):
        value[defined], reached[defined] = f, number
        _, shares[:, defined] = _join(composition.root, [leaf.value(time) for leaf in leaves], time)
    for leaf, share in zip(composition.leaves, shares, strict=True):
        for number in range(1, level + 1):
            there = np.flatnonzero((share != 0) & (reached == number))
            if len(there):
                gradient[there] += share[there, None] * _LeafAtPoints.at(leaf, points[there], time).gradient(number)
    return gradient.astype(np.float32), value.astype(np.float32)


def color(program: Program, points: Array, time: float, plain: Sequence[float] = (0.80, 0.74, 0.66)) -> Array:
    """Evaluate the color at points (N, 3): (N, 3) float32, sRGB in [0, 1]. plain: color of shapes without a texture."""
    composition = _composition(program)
    shares = np.zeros((len(composition.leaves), len(points)))
    for defined, leaves, _ in _levels(program, points, len(program.bands), time):
        _, shares[:, defined] = _join(composition.root, [leaf.value(time) for leaf in leaves], time)
    total = np.zeros((len(points), 3))
    for leaf, share in zip(composition.leaves, np.abs(shares), strict=True):
        there = np.flatnonzero(share)
        own = _LeafAtPoints.at(leaf, points[there], time).color()
        total[there] += share[there, None] * (np.array(plain) if own is None else own)
    return total.astype(np.float32)


def _composition(program: Program) -> Composition[Program]:
    assert program.composition is not None
    return program.composition


def _levels(
    program: Program, points: Array, level: int, time: float, margins: Margins | None = None
) -> Iterator[tuple[NDArray[np.int64], list[_LeafAtPoints], Values]]:
    """Yield for each level the indices (M,) of the points where it is defined, the leaves there, and f (M,)."""
    composition = _composition(program)
    defined = np.arange(len(points))
    leaves = [_LeafAtPoints.at(leaf, points, time) for leaf in composition.leaves]
    for number in range(1, level + 1):
        for leaf in leaves:
            leaf.refine(number)
        value, _ = _join(composition.root, [leaf.value(time) for leaf in leaves], time)
        yield defined, leaves, value
        if number < level:
            band = program.bands[number - 1].delta + (0.0 if margins is None else margins[number - 1])
            inside = np.flatnonzero(np.abs(value.astype(np.float32)) < band)
            defined, leaves = defined[inside], [leaf.only(inside) for leaf in leaves]


def _join(node: Join | int, values: list[Values], time: float) -> tuple[Values, Values]:
    """Return the value (N,) of a node, and the share of each leaf in that value (leaves, N)."""
    if not isinstance(node, Join):
        shares = np.zeros((len(values), len(values[node])))
        shares[node] = 1
        return values[node], shares
    total, shares = _join(node.parts[0], values, time)
    radius = node.radius.at(time)
    for part in node.parts[1:]:
        value, own = _join(part, values, time)
        if node.operation == DIFFERENCE:
            value, own = -value, -own
        if node.operation == SMOOTH_UNION:
            kept = np.clip(0.5 + 0.5 * (value - total) / radius, 0, 1)
        else:
            kept = (total <= value if node.operation == UNION else total >= value).astype(np.float64)
        total = kept * total + (1 - kept) * value
        total -= radius * kept * (1 - kept) if node.operation == SMOOTH_UNION else 0
        shares = kept * shares + (1 - kept) * own
    return total, shares


def _turn(axis: tuple[float, float, float], angle: float) -> Values:
    """Return the matrix (3, 3) of a rotation about an axis of length 1 (Rodrigues). angle: radians."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * cross @ cross)


def _fade(f: Values, delta: float) -> Values:
    """Return the factor on the residual inside a band |f| < delta."""
    return np.clip((delta - np.abs(f)) / (delta - delta / DELTA_FACTOR), 0, 1)


def _disc(disc: Disc, points: Values) -> tuple[Values, Values]:
    """Return the distance to a disc (N,), and its gradient (N, 3)."""
    around = np.hypot(points[:, 0], points[:, 2])
    half = disc.thickness / 2
    beside, above = around - disc.radius, np.abs(points[:, 1] + half) - half
    value = np.minimum(np.maximum(beside, above), 0) + np.hypot(np.maximum(beside, 0), np.maximum(above, 0))
    length = np.hypot(np.maximum(beside, 0), np.maximum(above, 0))
    corner = (beside > 0) & (above > 0)
    by_side = np.where(corner, np.maximum(beside, 0) / np.maximum(length, 1e-12), beside > above)
    by_top = np.where(corner, np.maximum(above, 0) / np.maximum(length, 1e-12), beside <= above)
    rim = by_side / np.maximum(around, 1e-12)
    up = by_top * np.where(points[:, 1] + half < 0, -1.0, 1.0)
    return value, np.stack([rim * points[:, 0], up, rim * points[:, 2]], axis=1)
