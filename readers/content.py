"""What a file of a shape holds: a mesh or a point cloud, and the facts that a person can check."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .paint import Paint
from .values import CornerValues, Doubles, Integers


@dataclass
class Facts:
    """What was taken from a file, for people. A reader adds to it."""

    meshes: int = 1
    """Meshes in the file, with their instances."""
    unwrapped: bool = False
    """Whether the mesh has texture coordinates."""
    taken: list[str] = field(default_factory=list)
    """Further parts of the line: the columns of a cloud, the pose of a skin."""
    warnings: list[str] = field(default_factory=list)
    """Lines for the user, without the file's name."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in input space."""

    vertices: Doubles
    """(V, 3)."""
    faces: Integers
    """(F, 3), indices of vertices."""
    normals: CornerValues | None = None
    """The file's normals at the corners of faces, of any length; None if it has none."""
    paint: Paint | None = None
    """Colors; None if the file has none."""
    facts: Facts = field(default_factory=Facts)

    def take(self, faces: NDArray[np.bool_]) -> "Mesh":
        """Keep the faces of a mask (F,)."""
        return replace(
            self,
            faces=self.faces[faces],
            normals=self.normals and self.normals.take(faces),
            paint=self.paint and self.paint.take(faces),
        )

    def flipped(self, faces: NDArray[np.bool_]) -> "Mesh":
        """Reverse the order of the corners of the faces of a mask (F,)."""
        return replace(
            self,
            faces=np.where(faces[:, None], self.faces[:, ::-1], self.faces),
            normals=self.normals and self.normals.flipped(faces),
            paint=self.paint and self.paint.flipped(faces),
        )


@dataclass(frozen=True, eq=False)
class Cloud:
    """A point cloud in input space."""

    points: Doubles
    """(N, 3)."""
    normals: Doubles | None = None
    """(N, 3), of any length; None if the file has none."""
    colors: Doubles | None = None
    """(N, 3), sRGB in [0, 1]; None if the file has none."""
    facts: Facts = field(default_factory=Facts)

    def take(self, points: NDArray[np.bool_]) -> "Cloud":
        """Keep the points of a mask (N,)."""
        normals, colors = (None if part is None else part[points] for part in (self.normals, self.colors))
        return Cloud(self.points[points], normals, colors, self.facts)
