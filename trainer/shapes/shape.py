"""What training needs to know of a shape, and the normalisation that every shape goes through."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

SHORTEST = 1e-300
"""A vector below this length counts as this long where it is scaled to length one."""
CELLS = 32
"""Cells along a unit of length by which `asked_together` sorts."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a surface with their normals."""

    points: Doubles
    """(N, 3), model space; (N, 4) of a shape that moves, with the time."""
    normals: Doubles
    """(N, 3), outward, of length one."""
    colours: Doubles | None = None
    """(N, 3), sRGB in [0, 1]; None where the shape has none, or they were not asked for."""


class Shape(Protocol):
    """A shape in model space: it fits the unit sphere, and distances are negative inside."""

    @property
    def name(self) -> str:
        """The shape's name for people."""
        ...

    @property
    def centre(self) -> tuple[float, float, float]:
        """The centre of the bounding box in input space = model space * scale + centre."""
        ...

    @property
    def scale(self) -> float:
        """The length in input space of one unit of model space."""
        ...

    @property
    def noise(self) -> float:
        """The standard deviation of the noise that was removed from the input's points, model units; 0: none."""
        ...

    @property
    def cloud(self) -> bool:
        """Whether it is known by points alone."""
        ...

    @property
    def coloured(self) -> bool:
        """Whether `surface` can give colours."""
        ...

    @property
    def moving(self) -> bool:
        """Whether it moves while t goes from 0 to 1: points of `surface`, `inputs` and `distance` then are (N, 4)."""
        ...

    @property
    def source(self) -> dict[str, Any]:
        """What the model's provenance keeps of the input: its file name and sha256."""
        ...

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw `count` points of the surface, uniform by area where the input allows.

        held_out: draw none of those that training sees. colours: ask for colours, which may cost more than the points.
        """
        ...

    def inputs(self) -> Doubles:
        """Return the input's own points x_j of Eq. 5, a mesh's vertices or a cloud's points: (N, 3)."""
        ...

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance at points (N, 3). Returns (N,), NaN where a cloud does not say."""
        ...


def normalise(points: Doubles) -> tuple[Doubles, tuple[float, float, float], float]:
    """Move the centre of the bounding box to the origin, and scale the largest norm to 1 (Section 4, evaluation).

    points: (N, 3), of which some must differ. Returns the new points (N, 3), and the centre and the scale of `Shape`.
    """
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    scale = float(np.linalg.norm(points - centre, axis=1).max())
    x, y, z = (float(c) for c in centre)
    return (points - centre) / scale, (x, y, z), scale


def unit(vectors: Doubles) -> Doubles:
    """Scale vectors (N, 3) to length one; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, SHORTEST))


def asked_together(distance: Callable[[Doubles], Doubles], points: Doubles) -> Doubles:
    """Compute distances (N,) at points (N, 3), in the order of a grid's cells, so that like places follow one another.

    What a tree needs for one is then in the processor's caches from the one before. Distances to a mesh of 100,000
    faces take a fourth of the time, to one of ten million half, to a cloud of 100,000 points 0.6 times.
    """
    order = np.lexsort(np.floor(points * CELLS).T)
    result = np.empty(len(points))
    result[order] = distance(points[order])
    return result
