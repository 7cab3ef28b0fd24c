"""The composition of a scene: the programs of its models, each in a space of its own, and how their values are joined.

Let q be the point in a shape's own space, s the shape's scale in the scene, o = |q| - 1, and q' = q / max(|q|, 1): q,
or the point of the unit sphere below it. The shape's value at level k is s * bounded(f_k(q')), where

- f_1 is the first network, and f_{k+1} = f_k + fade(f_k) * r_k where level k + 1 is defined (Eq. 3; program.py).
  Elsewhere, and without a further level, f_{k+1} = f_k.
- fade(f) = clamp((delta_k - |f|) / (delta_k - delta_k / OFFSET), 0, 1): the residual fades out towards the band's edge,
  so that a smooth union shows no edge there. Up to |f| = delta_k / OFFSET, where the surface is (Eq. 5), it is 1.
- bounded(f) = f for o <= 0, the hypotenuse of o and max(f, 0) for 0 < o < margin, and o beyond, where no network is
  evaluated. Each is a lower bound of the distance to the shape.

A `Join` folds its parts' values from the left. Union: the minimum; intersection: the maximum; difference: the maximum
of the first and minus the other. Smooth union of a and b with the radius k: h a + (1 - h) b - k h (1 - h), with h =
clamp(1/2 + (b - a) / (2 k), 0, 1).

The scene's field at level k is the tree's value of the shapes' values at level k, and the scene's bands define where
level k + 1 is defined. A shape's share is the derivative of the scene's value with respect to the shape's value.
Gradient and color of the scene are the shapes' sums, weighted by the shares (the color by their absolute values).
"""

from dataclasses import dataclass

from ..model.expression import Expression
from ..model.scene import Disc, Placement
from .program import Program

OFFSET = 1.3
"""delta / max |f_i(x_j)| (Eq. 5): the surface lies where |f_i| <= delta / OFFSET."""
MARGIN = 0.1
"""Default distance outside a shape's unit sphere up to which its network is evaluated, in radii of the shape."""


@dataclass(frozen=True, eq=False)
class Leaf:
    """One shape of a scene."""

    part: Program | Disc
    """A model's program, or a plate."""
    places: tuple[Placement, ...]
    """Placements, the outermost first."""
    time: Expression
    """The fourth input of a moving program."""
    margin: Expression
    """Distance outside the unit sphere up to which the network is evaluated, in radii of the shape."""


@dataclass(frozen=True)
class Join:
    """An operation on leaves, by index, and on other joins."""

    operation: str
    """One of model/scene.py's OPERATIONS."""
    radius: Expression
    """Of a smooth union, model units of the scene."""
    parts: "tuple[Join | int, ...]"
    """At least one."""


@dataclass(frozen=True, eq=False)
class Composition:
    """A scene without its bands."""

    programs: tuple[Program, ...]
    """The models' programs, with different names of functions and constants. Each is in a leaf."""
    leaves: tuple[Leaf, ...]
    """The scene's shapes."""
    root: Join
    """How the leaves are joined."""
