"""The point cloud of a depth map: the work of `unproject`, without its files and messages."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import check_writable, show, write_whole
from ..model.kinds import MESH
from .depth_map import Doubles
from .options import UnprojectOptions
from .ply import to_ply
from .unproject import Cloud, Cut
from .views import read_view


@dataclass(frozen=True, eq=False)
class Unprojected:
    """An oriented point cloud that a depth map became. The camera is at the origin and looks along -z, y points up."""

    points: Doubles
    """(N, 3), in the unit of the depths."""
    normals: Doubles
    """(N, 3), of length 1, outward."""
    colours: NDArray[np.uint8] | None
    """(N, 3), sRGB; None without a picture."""
    size: tuple[int, int]
    """Width and height of the depth map."""
    noise: float
    """Standard deviation of the depths' noise, as a share of the depth."""
    cut: Cut
    """How many pixels gave no point, and why."""
    warning: str
    """What is to be known of it, a line; empty where there is nothing."""

    def __repr__(self) -> str:
        """Describe the cloud in a line."""
        with_or_without = "with" if self.colours is not None else "without"
        return f"<mplicits.Unprojected: {len(self.points):,} points with normals, {with_or_without} colours>"

    def arrays(self) -> tuple[Doubles, Doubles] | tuple[Doubles, Doubles, Doubles]:
        """Return what `mplicits.train` takes: points, normals and, where there are any, colours in [0, 1]."""
        if self.colours is None:
            return self.points, self.normals
        return self.points, self.normals, self.colours / 255

    def text(self) -> bytes:
        """Return the content of a PLY file."""
        return to_ply(Cloud(self.points, self.normals, self.colours))

    def save(self, path: str | Path) -> None:
        """Write the cloud as a PLY file, whole or not at all. Raises UserError for a name that does not end in .ply."""
        check_cloud_name(Path(path))
        check_writable(Path(path), kind=MESH)
        write_whole(Path(path), self.text())


def unprojected(options: UnprojectOptions) -> Unprojected:
    """Turn a depth map, or a photograph, into a cloud. Raises UserError."""
    view = read_view(options)
    cloud, cut, noise = view.unprojected(options.close)
    height, width = view.depth.shape
    return Unprojected(cloud.points, cloud.normals, cloud.colours, (width, height), noise, cut, view.warning)


def check_cloud_name(path: Path) -> None:
    """Raise UserError where a file's name does not say that it is a PLY."""
    if path.suffix.lower() != ".ply":
        raise UserError(f"{show(path)}: clouds are PLY; name it .ply")
