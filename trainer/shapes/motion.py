"""A shape that moves: moments of it, evenly spaced while t goes from 0 to 1, and computed surfaces between them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import igl
import numpy as np
from numpy.typing import NDArray

from .between import CELLS, Between, Grid, between, distances, interpolated, triangles
from .shape import Doubles, Shape, SurfacePoints, unit

SURFACES = 32
"""Steps in time from one surface to the next, at least: moments that are fewer get surfaces between them."""
MOMENT_WEIGHT = 6
"""Samples of a moment, for each of a surface between moments: the moments are what was asked for."""
INPUTS_BETWEEN = 2000
"""Points of each surface between moments that `MovingShape.inputs` has."""
COLOURED = 3000
"""Points of a surface between moments whose colours are looked up."""
NEGLIGIBLE = 1e-5
"""A surface that counts for less at a time is left out."""


class Coloured(Shape, Protocol):
    """A shape that can be a moment: it says which colours are near."""

    def colours_near(self, points: Doubles) -> Doubles | None:
        """Return the colours (N, 3), sRGB in [0, 1], of the places nearest to points (N, 3); None without colours."""
        ...


@dataclass(frozen=True, eq=False)
class Moment:
    """A shape at its place in the space of the motion: position = offset + factor * position in the shape's own."""

    shape: Coloured
    offset: Doubles
    """(3,)."""
    factor: float

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw points of the surface; see `Shape.surface`."""
        drawn = self.shape.surface(count, rng, held_out=held_out, colours=colours)
        return replace(drawn, points=self.offset + self.factor * drawn.points)

    def inputs(self) -> Doubles:
        """Return the input's own points (N, 3)."""
        return self.offset + self.factor * self.shape.inputs()

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance at points (N, 3)."""
        return self.factor * self.shape.distance((points - self.offset) / self.factor)

    def colours_near(self, points: Doubles) -> Doubles | None:
        """Return the colours (N, 3) of the nearest places of the surface."""
        return self.shape.colours_near((points - self.offset) / self.factor)


class SurfaceBetween:
    """A surface between two moments, with its signed distance, and colours mixed from those nearest on both."""

    def __init__(self, field: Grid, share: float, moments: tuple[Moment, Moment]) -> None:
        """field: zero on the surface (`Between.field`), which is not empty. share: of the way to the second moment."""
        self._field, self._share, self._moments = field, share, moments
        self._vertices, self._faces, self._normals = triangles(field)
        corners = self._vertices[self._faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._areas = np.cumsum(np.linalg.norm(across, axis=1))
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._faces)

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw points of the surface; `held_out` changes nothing, since every call draws new points.

        Of points with colours, `COLOURED` are drawn, and repeated: these colours are mixtures without fine detail.
        """
        if colours and count > COLOURED:
            few = self.surface(COLOURED, rng, colours=True)
            index = rng.integers(COLOURED, size=count)
            found = None if few.colours is None else few.colours[index]
            return SurfacePoints(few.points[index], few.normals[index], found)
        face = self._faces[np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")]
        weights = rng.dirichlet(np.ones(3), count)[:, :, None]
        points = (self._vertices[face] * weights).sum(axis=1)
        normals = unit((self._normals[face] * weights).sum(axis=1))
        return SurfacePoints(points, normals, self.colours_near(points) if colours else None)

    def inputs(self) -> Doubles:
        """Return points of the surface, always the same."""
        return self.surface(INPUTS_BETWEEN, np.random.default_rng(0)).points

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance at points (N, 3)."""
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sign(interpolated(self._field, points)) * np.sqrt(squared))

    def colours_near(self, points: Doubles) -> Doubles | None:
        """Mix the colours that are nearest on both moments' surfaces, by the share of the way between them."""
        first, second = (moment.colours_near(points) for moment in self._moments)
        return None if first is None or second is None else (1 - self._share) * first + self._share * second


class MovingShape:
    """A `Shape` that moves from one moment to the next; its points are (N, 4), with a time in [0, 1]."""

    moving = True
    noise = 0.0
    cloud = False

    def __init__(
        self,
        moments: Sequence[Moment],
        name: str,
        source: dict[str, Any],
        centre: tuple[float, float, float],
        scale: float,
        surfaces: int | None = None,
    ) -> None:
        """Put the moments together, and compute the surfaces between them.

        moments: two or more. name, source, centre, scale: of the `Shape`. surfaces: least number of steps from one
        surface to the next; None: `SURFACES`.
        """
        self.name, self.source, self.centre, self.scale = name, source, centre, scale
        self.coloured = all(moment.shape.coloured for moment in moments)
        steps = math.ceil((SURFACES if surfaces is None else surfaces) / (len(moments) - 1))
        grids = [distances(moment, CELLS) for moment in moments] if steps > 1 else []
        self._surfaces: list[Moment | SurfaceBetween] = []
        times, weights = [], []
        for k, moment in enumerate(moments):
            self._surfaces.append(moment)
            times.append(k / (len(moments) - 1))
            weights.append(MOMENT_WEIGHT)
            if steps == 1 or k + 1 == len(moments):
                continue
            change: Between = between(grids[k], grids[k + 1])
            for j in range(1, steps):
                field = change.field(j / steps)
                if (field < 0).any():
                    self._surfaces.append(SurfaceBetween(field, j / steps, (moment, moments[k + 1])))
                    times.append((k + j / steps) / (len(moments) - 1))
                    weights.append(1)
        self._times = np.array(times)
        self._shares = np.array(weights) / sum(weights)

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw points of the surfaces, (count, 4), most of them of the moments; the normals are those in space."""
        counts = rng.multinomial(count, self._shares)
        drawn = [
            surface.surface(int(n), rng, held_out=held_out, colours=colours)
            for surface, n in zip(self._surfaces, counts, strict=True)
        ]
        order = rng.permutation(count)
        points = np.column_stack((np.concatenate([part.points for part in drawn]), np.repeat(self._times, counts)))
        found = [part.colours for part in drawn if part.colours is not None]
        return SurfacePoints(
            points[order],
            np.concatenate([part.normals for part in drawn])[order],
            np.concatenate(found)[order] if len(found) == len(drawn) else None,
        )

    def inputs(self) -> Doubles:
        """Return the moments' own points, and some of the surfaces between: (N, 4)."""
        parts = [surface.inputs() for surface in self._surfaces]
        times = np.repeat(self._times, [len(part) for part in parts])
        return np.column_stack((np.concatenate(parts), times))

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance at points (N, 4): between two surfaces' times, a mean of both distances."""
        place = np.interp(points[:, 3], self._times, np.arange(len(self._times)))
        total = np.zeros(len(points))
        for k, surface in enumerate(self._surfaces):
            weight = 1 - np.abs(place - k)
            rows = np.flatnonzero(weight > NEGLIGIBLE)
            if len(rows):
                total[rows] += weight[rows] * surface.distance(points[rows, :3])
        return total


def common_place(shapes: Sequence[Shape]) -> tuple[tuple[float, float, float], float]:
    """Find one centre and scale for shapes that stand in one input space, as `normalise` does for one."""
    boxes, clouds = [], []
    for shape in shapes:
        cloud = shape.inputs() * shape.scale + shape.centre
        clouds.append(cloud)
        boxes.append((cloud.min(axis=0), cloud.max(axis=0)))
    middle = (np.min([low for low, _ in boxes], axis=0) + np.max([high for _, high in boxes], axis=0)) / 2
    scale = max(float(np.linalg.norm(cloud - middle, axis=1).max()) for cloud in clouds)
    x, y, z = (float(c) for c in middle)
    return (x, y, z), scale


def placed(shape: Coloured, centre: tuple[float, float, float], scale: float) -> Moment:
    """Put a shape where it stands in input space, in a model space of this centre and scale."""
    offset: NDArray[np.float64] = (np.array(shape.centre) - np.array(centre)) / scale
    return Moment(shape, offset, shape.scale / scale)
