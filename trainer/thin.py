"""Thin places of a mesh, narrow slits and sharp edges, that a residual fills or loses while it is trained."""

from collections.abc import Callable

import numpy as np

from .networks.losses import LACK
from .shapes.shape import Doubles, Shape

Field = Callable[[Doubles], Doubles]
"""Points (N, 3) -> the values (N,) of a field."""

LEAST_STEP, MOST_STEP = 0.0005, 0.005
"""How far along its normal a point of the surface is moved, to either side, model units."""
SUSPECTS = 100_000
"""Most of these points whose distance to the surface is computed."""
NEARER = 0.8
"""The place is thin where another part of the surface is nearer than this share of that step."""
FACING = 0.2
"""Most cosine between the normals of the two parts: both sides of a slit, of a sharp edge or of a narrow passage are
turned to each other, those of a shallow crease are not."""
APART = 1e-4
"""Distance of two points by which the gradient of the distance is measured, model units."""
LEAST_DISTANCE = 0.0003
"""Least distance of such a point from the surface, model units."""
MARGIN = 0.0025
"""Least size that f is taught there, model units: what is taught a distance below the error of f may keep the wrong
sign."""
HELD = 0.7
"""A thin place counts until f has this share of `MARGIN` there."""
SPREAD = 0.004
"""How far points around thin places are from them along each axis, model units: standard deviation."""
AROUND = 1.5
"""How many of these points are looked at for each thin place."""
AROUND_LEAST = 0.0008
"""Least distance of these points from the surface, model units."""


class ThinPlaces:
    """The thin places of a shape that its level got wrong at some time, which is held to them from then on."""

    def __init__(self, shape: Shape, rng: np.random.Generator) -> None:
        """shape: a mesh that stands still. rng: draws the places."""
        self._shape, self._rng = shape, rng
        self.known = np.empty((0, 4), np.float32)
        """Points of these places, with their signed distances: (N, 4)."""

    def look(self, field: Field, count: int) -> None:
        """Look for places that are wrong by now, off `count` points of the surface.

        field: the level as it is now.
        """
        drawn = self._shape.surface(count, self._rng)
        step, side = self._rng.uniform(LEAST_STEP, MOST_STEP, count), self._rng.choice((-1.0, 1.0), count)
        points = drawn.points + (side * step)[:, None] * drawn.normals
        lacks = np.flatnonzero(field(points) * side < LACK * np.minimum(step, MARGIN))[:SUSPECTS]
        points, step, side = points[lacks], step[lacks], side[lacks]
        distance = self._shape.distance(points)
        thin = np.flatnonzero((distance * side > LEAST_DISTANCE) & (np.abs(distance) < NEARER * step))
        facing = (self._gradient(points[thin]) * drawn.normals[lacks[thin]]).sum(axis=1) < FACING
        found = np.column_stack((points, distance))[thin[facing]].astype(np.float32)
        self.known = np.concatenate((self.known, found))

    def hard(self, field: Field) -> tuple[Doubles, Doubles]:
        """Return the points in and around thin places that are wrong by now, and what f is to be there.

        Around them, too: an edge that is drawn out beyond its end is as wrong as one that is lost. Returns points
        (M, 3) and signed distances (M,), those of the places themselves no smaller than `MARGIN`.
        """
        points, distance = self._known()
        lacks = field(points) * np.sign(distance) < HELD * MARGIN
        seeds = points[self._rng.integers(len(points), size=round(AROUND * len(points)))] if len(points) else points
        around = seeds + self._rng.normal(scale=SPREAD, size=seeds.shape)
        truth = self._shape.distance(around)
        wrong = (field(around) * np.sign(truth) < LACK * np.abs(truth)) & (np.abs(truth) > AROUND_LEAST)
        return np.concatenate((points[lacks], around[wrong])), np.concatenate((_aim(distance[lacks]), truth[wrong]))

    def lost(self, field: Field) -> tuple[Doubles, Doubles]:
        """Return the thin places where f has the wrong sign by now, and what it is to be there.

        Returns points (M, 3) and signed distances (M,), no smaller than `MARGIN`.
        """
        points, distance = self._known()
        wrong = field(points) * np.sign(distance) < 0
        return points[wrong], _aim(distance[wrong])

    def _known(self) -> tuple[Doubles, Doubles]:
        """Return the points of these places (N, 3), and their signed distances (N,)."""
        known = self.known.astype(np.float64)
        return known[:, :3], known[:, 3]

    def _gradient(self, points: Doubles) -> Doubles:
        """Measure the gradient (N, 3) of the shape's distance at points (N, 3): the normal of the nearest part."""
        shift = APART / 2 * np.eye(3)[:, None]
        there = np.concatenate((points + shift, points - shift)).reshape(-1, 3)
        ahead, behind = self._shape.distance(there).reshape(2, 3, -1)
        return (ahead - behind).T / APART


def _aim(distance: Doubles) -> Doubles:
    """Return what f is to be at thin places whose signed distances (N,) are these: (N,)."""
    return np.copysign(np.maximum(np.abs(distance), MARGIN), distance)
