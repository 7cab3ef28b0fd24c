"""What training needs to know of a shape, and the normalisation every shape goes through."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surface:
    """Oriented points of a surface, model space. points, normals: (n, 3); colours: (n, 3) sRGB in [0, 1], or None."""

    points: Doubles
    normals: Doubles
    colours: Doubles | None = None


class Shape(Protocol):
    """A shape in model space: it fits the unit sphere, distances are negative inside.

    name: for people. centre, scale: input space = model space * scale + centre.
    resolution: `distance` is right where it is larger; 0 where it is exact (a mesh, a formula; not a cloud of samples).
    coloured: whether `surface` gives colours. source: what provenance keeps of the input.
    """

    @property
    def name(self) -> str: ...
    @property
    def centre(self) -> tuple[float, float, float]: ...
    @property
    def scale(self) -> float: ...
    @property
    def resolution(self) -> float: ...
    @property
    def coloured(self) -> bool: ...
    @property
    def source(self) -> dict[str, Any]: ...

    def surface(self, count: int, rng: np.random.Generator, held_out: bool = False) -> Surface:
        """`count` points, uniform by area where the input allows; `held_out`: never those that training sees."""
        ...

    def inputs(self) -> Doubles:
        """The input's own points x_j of Eq. 5: a mesh's vertices, a cloud's points. (n, 3)"""
        ...

    def distance(self, points: Doubles) -> Doubles:
        """Signed distance at points (n, 3): (n,)."""
        ...

    def clearance(self, points: Doubles) -> Doubles:
        """Distance without its sign, which may cost less. (n,)"""
        ...


def normalise(points: Doubles) -> tuple[Doubles, tuple[float, float, float], float]:
    """Moves the centre of the bounding box to the origin and the largest norm to 1 (Section 4, evaluation protocol).

    Returns the points (n, 3), the centre and the scale of `Shape`. The extent must not be zero.
    """
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    scale = float(np.linalg.norm(points - centre, axis=1).max())
    x, y, z = (float(c) for c in centre)
    return (points - centre) / scale, (x, y, z), scale


def unit(vectors: Doubles) -> Doubles:
    """Vectors (n, 3) scaled to length 1; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-300))
