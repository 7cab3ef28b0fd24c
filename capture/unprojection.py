"""What `unproject` does: reads a picture with depths, a camera and colors, and turns it into a cloud."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import check_writable, path_of, show, write_whole
from ..model.kinds import MESH
from .cloud import Cloud, Cut, Doubles, check_name
from .depth_map import LEAST, check_size, from_inverse, read_depth
from .estimate import estimate_depth
from .image_pixels import colors_of, mask_of, opaque, open_upright, resized
from .intrinsics import Intrinsics, of_file, of_photograph, of_view
from .options import DEFAULT_FOV, RELATIVE_RANGE, UnprojectOptions
from .unproject import step_share, unproject

ASSUMED = f"camera unknown; assuming {DEFAULT_FOV:g} degrees from top to bottom (--fov, --intrinsics)"
"""Warning for a picture without a known camera."""


@dataclass(frozen=True, eq=False)
class Unprojected(Cloud):
    """The oriented point cloud of a depth map. The camera is at the origin and looks along -z; y points up."""

    size: tuple[int, int]
    """Width and height of the depth map."""
    noise: float
    """Standard deviation of the depths' noise, as a share of the depth."""
    cut: Cut
    """Numbers of pixels without a point."""
    warning: str
    """One line for the user, or ""."""
    notes: tuple[str, ...] = ()
    """What was taken of the file: the channel, a background that is left out."""

    def __repr__(self) -> str:
        """Describe the cloud in a line."""
        with_or_without = "with" if self.colors is not None else "without"
        return f"<mplicits.Unprojected: {len(self.points):,} points with normals, {with_or_without} colors>"

    def arrays(self) -> tuple[Doubles, Doubles] | tuple[Doubles, Doubles, Doubles]:
        """Return the arrays for `mplicits.train`: points, normals and, if there are any, colors in [0, 1]."""
        if self.colors is None:
            return self.points, self.normals
        return self.points, self.normals, self.colors / 255

    def save(self, path: str | Path) -> None:
        """Write the cloud as a PLY file, whole or not at all. Raises UserError for a name without .ply."""
        file = path_of(path, "path")
        check_name(file)
        check_writable(file, kind=MESH)
        write_whole(file, self.to_ply())


def unprojected(options: UnprojectOptions) -> Unprojected:
    """Read the files, and turn the picture into a cloud. Raises UserError."""
    option, named = ("--image", options.image) if options.image else ("--estimate", options.estimate)
    photograph = Path(named) if named else None
    picture = open_upright(photograph, option) if photograph else None
    values, inverse, whole, notes = _values(options)
    height, width = values.shape
    depth = values
    if picture is not None:
        picture = resized(picture, height, width, f"{option} {show(photograph or '')}")
        depth = _within(depth, opaque(picture))
    if options.mask is not None:
        mask = resized(open_upright(Path(options.mask), "--mask"), height, width, f"--mask {show(options.mask)}")
        depth = _within(depth, mask_of(mask))
    if np.isnan(depth).all():
        raise UserError("no pixel with a depth is left by the mask, or by the picture's transparency")
    if inverse:
        depth = from_inverse(depth, *(options.range or RELATIVE_RANGE))
    elif whole:
        depth = depth / options.unit
    depth = _within(depth, (depth >= LEAST) & (depth <= 1 / LEAST))
    if np.isnan(depth).all():
        raise UserError(f"no depth is from {LEAST:g} to {1 / LEAST:g}; are --unit and --range right?")
    step = step_share(values, depth, inverse)
    known = _camera(options, photograph, height, width)
    camera = known or of_view(DEFAULT_FOV, height, width)
    if options.ray:
        x, y = camera.plane(height, width)
        depth = depth / np.sqrt(1 + x**2 + y[:, None] ** 2)
    if options.range and not inverse:
        depth = _within(depth, (depth >= options.range[0]) & (depth <= options.range[1]))
        if np.isnan(depth).all():
            raise UserError("no depth lies within --range; is --unit right?")
    colors = None if picture is None else colors_of(picture)
    cloud, cut, planes = unproject(depth, camera, colors, step, close=options.close)
    warning = "" if known else ASSUMED
    return Unprojected(cloud.points, cloud.normals, cloud.colors, (width, height), planes.noise, cut, warning, notes)


def _values(options: UnprojectOptions) -> tuple[Doubles, bool, bool, tuple[str, ...]]:
    """Read or estimate the depths (H, W). Also returns whether they are inverse, or integers, and notes for people."""
    if options.depth is not None:
        read = read_depth(Path(options.depth))
        return read.values, options.relative, read.whole, read.notes
    assert options.estimate is not None
    photograph = open_upright(Path(options.estimate), "--estimate").convert("RGB")
    try:
        check_size((photograph.height, photograph.width))
    except UserError as error:
        raise UserError(f"--estimate {show(options.estimate)}: {error}") from None
    values, inverse = estimate_depth(photograph, options.estimator)
    return values, inverse or options.relative, False, ()


def _within(depth: Doubles, mask: NDArray[np.bool_] | None) -> Doubles:
    return depth if mask is None else np.where(mask, depth, np.nan)


def _camera(options: UnprojectOptions, photograph: Path | None, height: int, width: int) -> Intrinsics | None:
    """Choose the camera of the options, or of the photograph's EXIF; None if neither exists."""
    if options.intrinsics is not None:
        return of_file(Path(options.intrinsics), height, width)
    if options.fov is not None:
        return of_view(options.fov, height, width)
    return of_photograph(photograph, height, width) if photograph else None
