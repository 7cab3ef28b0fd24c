"""What a scene computes: the programs of its models, each at points of its own, and how their values are joined.

With q = the point in a shape's own space and s = its scale in the scene's, the shape's value at level k is
s * bounded(f_k(q')), where q' = q / max(|q|, 1) is q or, outside the unit sphere that holds the shape, the point of the
sphere below it, and, with o = |q| - 1:

- f_1 is the first network, and f_{k+1} = f_k + fade(f_k) * r_k where |f_k| < delta_k and all levels before are so
  defined; where it is not, or the model has no further level, f_{k+1} = f_k.
- fade(f) = clamp((delta_k - |f|) / (delta_k - delta_k / OFFSET), 0, 1): the residual ends where its band ends, and has
  no edge there that a soft seam would show. Up to |f| = delta_k / OFFSET, where the surface is (Eq. 5), it is 1.
- bounded(f) = f for o <= 0, the hypotenuse of o and max(f, 0) for 0 < o < margin, and o beyond, where no network is
  asked: each bounds the distance to the shape from below.

A `Join` folds its parts' values from the left. Union: the least; intersection: the largest; difference: the larger of
the first and minus the other. Smooth union of a and b with the radius k: h a + (1 - h) b - k h (1 - h), with
h = clamp(1/2 + (b - a) / (2 k), 0, 1).

The field of the scene at level k is its tree's value of the shapes' values at level k, and the scene's bands say where
level k + 1 is defined. The tree also says which share each shape has in the value, its derivative with respect to the
shape's value: gradient and colour are the shapes', in these shares (the colour without their signs).
"""

from dataclasses import dataclass

from ..model.expression import Expression
from ..model.scene import Disc, Placement
from .program import Program

OFFSET = 1.3
"""Part of a band in which the surface is: delta / max |f_i(x_j)| (Eq. 5)."""
MARGIN = 0.1
"""How far outside a shape's unit sphere its network is asked, in radii of the shape, where no seam needs more."""


@dataclass(frozen=True, eq=False)
class Leaf:
    """One shape of a scene."""

    part: Program | Disc
    """A program of one model, or a plate."""
    places: tuple[Placement, ...]
    """Where it is: the outermost placement first."""
    time: Expression
    """The fourth input of a program that moves."""
    margin: Expression
    """How far outside the unit sphere its network is asked, in its radii."""


@dataclass(frozen=True)
class Join:
    """Leaves, by index, and joins of them, joined by an operation."""

    operation: str
    """One of model/scene.py's OPERATIONS."""
    radius: Expression
    """Of a smooth union, model units of the scene."""
    parts: "tuple[Join | int, ...]"
    """At least one."""


@dataclass(frozen=True, eq=False)
class Composition:
    """All of a scene but its bands."""

    programs: tuple[Program, ...]
    """Of the models, each with functions and constants of other names; all are among the leaves."""
    leaves: tuple[Leaf, ...]
    """The shapes."""
    root: Join
    """How they are joined."""
