"""The composition of a scene: the programs of its shapes, their placements, and how their values are joined.

Let q be the point in a shape's space, s the shape's scale in the scene, o = |q| - 1, and q' = q / max(|q|, 1), which is
q inside the unit sphere of the shape and the nearest point of the sphere outside. The shape's value at level k is
s * bounded(f_k(q')), where

- f_1 is the first network. f_{k+1} = f_k + fade(f_k) * r_k where level k + 1 is defined, by the rule of
  field/interpret.py; f_{k+1} = f_k elsewhere and in models without level k + 1.
- fade(f) = clamp((delta_k - |f|) / (delta_k - delta_k / DELTA_FACTOR), 0, 1) ends the residual at the edge of its band
  without a jump, which a smooth union would show. It is 1 up to |f| = delta_k / DELTA_FACTOR, around the surface (Eq.
  5).
- bounded(f) = f for o <= 0, the hypotenuse of o and max(f, 0) for 0 < o < margin, and o beyond, where no network is
  evaluated. Each is a lower bound of the distance to the shape.

A `Join` folds its parts' values from the left. Union: the minimum. Intersection: the maximum. Difference: the maximum
of the first and minus the other. Smooth union of a and b with radius k: h a + (1 - h) b - k h (1 - h), with h =
clamp(1/2 + (b - a) / (2 k), 0, 1).

The field of the scene at level k is the root's value of the shapes' values at level k; the scene's bands define where
level k + 1 is defined. Gradient and color are the sums of the shapes' gradients and colors, weighted with the
derivative of the root's value by the shape's value (for colors, with its absolute value).
"""

from dataclasses import dataclass
from typing import Generic, TypeVar

from ..model.expression import Expression
from ..model.scene import Disc, Placement

Part = TypeVar("Part")
"""A `Program`, whose file imports this one."""
MARGIN = 0.1
"""Distance outside a shape's unit sphere up to which its network is evaluated, in its radii; smooth unions need
more."""


@dataclass(frozen=True, eq=False)
class Leaf(Generic[Part]):
    """One shape of a scene."""

    part: Part | Disc
    places: tuple[Placement, ...]
    """Placements, the outermost first."""
    time: Expression
    """The fourth input of a moving program."""
    margin: Expression
    """Distance outside the unit sphere up to which the network is evaluated, in the shape's radii."""


@dataclass(frozen=True)
class Join:
    """Joins leaves, given by index, and other joins."""

    operation: str
    """One of model/scene.py's OPERATIONS."""
    radius: Expression
    """Radius of a smooth union, model units of the scene."""
    parts: "tuple[Join | int, ...]"
    """At least one."""


@dataclass(frozen=True, eq=False)
class Composition(Generic[Part]):
    """A scene without its bands."""

    programs: tuple[Part, ...]
    """The programs of all leaves, without repetition; the names of their functions and constants differ."""
    leaves: tuple[Leaf[Part], ...]
    root: Join
