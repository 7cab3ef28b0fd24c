"""An oriented point cloud, and the PLY file of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.kinds import MARK

Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cloud:
    """An oriented point cloud. The camera is at the origin and looks along -z; y points up."""

    points: Doubles
    """(N, 3), in the unit of the depths."""
    normals: Doubles
    """(N, 3), outward unit vectors."""
    colors: NDArray[np.uint8] | None
    """(N, 3), sRGB; None without a picture."""

    def to_ply(self) -> bytes:
        """Encode the cloud as binary PLY: x y z nx ny nz [red green blue]."""
        columns = {name: ("<f4", column) for name, column in zip("xyz", self.points.T, strict=True)}
        columns |= {f"n{axis}": ("<f4", column) for axis, column in zip("xyz", self.normals.T, strict=True)}
        if self.colors is not None:
            columns |= {name: ("u1", self.colors[:, i]) for i, name in enumerate(("red", "green", "blue"))}
        table = np.empty(len(self.points), [(name, kind) for name, (kind, _) in columns.items()])
        for name, (_, column) in columns.items():
            table[name] = column
        words = {"<f4": "float", "u1": "uchar"}
        properties = "".join(f"property {words[kind]} {name}\n" for name, (kind, _) in columns.items())
        head = f"ply\nformat binary_little_endian 1.0\ncomment {MARK}\n"
        head += f"element vertex {len(table)}\n{properties}end_header\n"
        return head.encode() + table.tobytes()


@dataclass(frozen=True)
class Cut:
    """Numbers of pixels with a depth that yield no point."""

    grazing: int
    """The surface is nearly parallel to the ray."""
    edges: int
    """At a depth edge: too few neighbors lie on the same surface."""
    outliers: int
    """Off the surface of their neighbors, or in small components."""


def check_name(path: Path) -> None:
    """Raise UserError if a name does not end in .ply."""
    if path.suffix.lower() != ".ply":
        raise UserError(f"{show(path)}: clouds are PLY; name it .ply")
