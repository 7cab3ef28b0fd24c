"""A moving shape: moments, evenly spaced while t goes from 0 to 1, and computed surfaces between them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import igl
import numpy as np
from numpy.random import Generator

from .creases import face_areas
from .morph import CELLS, Grid, distances, interpolated, morph, triangles
from .reading_report import ReadingReport
from .shape import Doubles, Shape, SurfacePoints, as_triple, joined, unit

SURFACES = 32  # least number of steps in time; fewer moments get morphed surfaces between them
MOMENT_WEIGHT = 6  # samples of a moment for each sample of a morphed surface: the user supplied the moments
MORPHED_INPUTS = 2000  # points of each morphed surface in `MovingShape.inputs`
COLORED = 3000  # most points of a morphed surface whose colors are looked up; more points repeat them
NEGLIGIBLE = 1e-5  # surfaces with a smaller weight at a time are skipped


class ColoredShape(Shape, Protocol):
    """A shape that can be a moment: it can look up colors."""

    def colors_near(self, points: Doubles) -> Doubles | None:
        """Return the colors (N, 3), sRGB in [0, 1], of the surface nearest to points (N, 3); None without colors."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A shape placed in the motion's space: position = offset + factor * position in the shape's own space."""

    shape: ColoredShape
    offset: Doubles
    """(3,)."""
    factor: float

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        drawn = self.shape.surface(count, rng, held_out=held_out, colors=colors)
        return replace(drawn, points=self.offset + self.factor * drawn.points)

    def inputs(self) -> Doubles:
        return self.offset + self.factor * self.shape.inputs()

    def distance(self, points: Doubles) -> Doubles:
        return self.factor * self.shape.distance((points - self.offset) / self.factor)

    def colors_near(self, points: Doubles) -> Doubles | None:
        return self.shape.colors_near((points - self.offset) / self.factor)


class MorphedSurface:
    """A surface between two moments, with its signed distance, and colors mixed from both moments."""

    def __init__(self, field: Grid, share: float, moments: tuple[Moment, Moment]) -> None:
        """field: zero on the surface (`Morph.field`), which is not empty. share: of the way to the second moment."""
        self._field, self._share, self._moments = field, share, moments
        self._vertices, self._faces, self._normals = triangles(field)
        self._areas = np.cumsum(face_areas(self._vertices, self._faces))
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._faces)

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw `count` points uniformly by area; with colors, at most `COLORED` different ones."""
        if colors and count > COLORED:
            return self.surface(COLORED, rng, colors=True).take(rng.integers(COLORED, size=count))
        face = self._faces[np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")]
        weights = rng.dirichlet(np.ones(3), count)[:, :, None]
        points = (self._vertices[face] * weights).sum(axis=1)
        normals = unit((self._normals[face] * weights).sum(axis=1))
        return SurfacePoints(points, normals, self.colors_near(points) if colors else None)

    def inputs(self) -> Doubles:
        """Return fixed samples of the surface, (N, 3)."""
        return self.surface(MORPHED_INPUTS, np.random.default_rng(0)).points

    def distance(self, points: Doubles) -> Doubles:
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sign(interpolated(self._field, points)) * np.sqrt(squared))

    def colors_near(self, points: Doubles) -> Doubles | None:
        """Mix the nearest colors (N, 3) of both moments, by the share of the way between them."""
        first, second = (moment.colors_near(points) for moment in self._moments)
        return None if first is None or second is None else (1 - self._share) * first + self._share * second


class MovingShape:
    """A `Shape` whose points are (N, 4), with a time in [0, 1]."""

    moving = True
    taken: ReadingReport | None = None
    noise = 0.0
    cloud = False

    def __init__(
        self,
        moments: Sequence[Moment],
        name: str,
        source: dict[str, Any],
        center: tuple[float, float, float],
        scale: float,
        surfaces: int = SURFACES,
    ) -> None:
        """Compute the surfaces between two or more moments.

        name, source, center, scale: of the `Shape`. surfaces: least number of steps in time.
        """
        self.name, self.source, self.center, self.scale = name, source, center, scale
        self.colored = all(moment.shape.colored for moment in moments)
        steps = math.ceil(surfaces / (len(moments) - 1))
        grids = [distances(moment, CELLS) for moment in moments] if steps > 1 else []
        self._surfaces: list[Moment | MorphedSurface] = []
        times, weights = [], []
        for k, moment in enumerate(moments):
            self._surfaces.append(moment)
            times.append(k / (len(moments) - 1))
            weights.append(MOMENT_WEIGHT)
            if steps == 1 or k + 1 == len(moments):
                continue
            change = morph(grids[k], grids[k + 1])
            for j in range(1, steps):
                field = change.field(j / steps)
                if (field < 0).any():
                    self._surfaces.append(MorphedSurface(field, j / steps, (moment, moments[k + 1])))
                    times.append((k + j / steps) / (len(moments) - 1))
                    weights.append(1)
        self._times = np.array(times)
        self._shares = np.array(weights) / sum(weights)

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw points (count, 4), most of them from the moments; normals are spatial."""
        counts = rng.multinomial(count, self._shares)
        drawn = joined(
            [
                surface.surface(int(n), rng, held_out=held_out, colors=colors)
                for surface, n in zip(self._surfaces, counts, strict=True)
            ]
        )
        points = np.column_stack((drawn.points, np.repeat(self._times, counts)))
        return replace(drawn, points=points).take(rng.permutation(count))

    def inputs(self) -> Doubles:
        """Return the moments' own points and samples of the surfaces between them, (N, 4)."""
        parts = [surface.inputs() for surface in self._surfaces]
        times = np.repeat(self._times, [len(part) for part in parts])
        return np.column_stack((np.concatenate(parts), times))

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance (N,) at points (N, 4), interpolated in time between surfaces."""
        place = np.interp(points[:, 3], self._times, np.arange(len(self._times)))
        total = np.zeros(len(points))
        for k, surface in enumerate(self._surfaces):
            weight = 1 - np.abs(place - k)
            rows = np.flatnonzero(weight > NEGLIGIBLE)
            if len(rows):
                total[rows] += weight[rows] * surface.distance(points[rows, :3])
        return total


def common_place(shapes: Sequence[Shape]) -> tuple[tuple[float, float, float], float]:
    """Find one center and scale for shapes that share an input space, as `normalize` does for one shape."""
    clouds = [shape.inputs() * shape.scale + shape.center for shape in shapes]
    low, high = (
        np.min([cloud.min(axis=0) for cloud in clouds], axis=0),
        np.max([c.max(axis=0) for c in clouds], axis=0),
    )
    middle = (low + high) / 2
    return as_triple(middle), max(float(np.linalg.norm(cloud - middle, axis=1).max()) for cloud in clouds)


def placed(shape: ColoredShape, center: tuple[float, float, float], scale: float) -> Moment:
    """Place a shape of input space in the model space of a center and scale."""
    return Moment(shape, (np.array(shape.center) - np.array(center)) / scale, shape.scale / scale)
