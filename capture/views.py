"""The view that `unproject` reads: depths, a camera and colours of one picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .depth_map import Doubles, from_inverse, read_depth
from .estimate import estimate_depth
from .intrinsics import Intrinsics, of_file, of_photograph, of_view
from .options import DEFAULT_FOV, RELATIVE_RANGE, UnprojectOptions
from .photograph import colours_of, fitted, masked, open_picture, solid
from .unproject import Cloud, Cut, step_share, unproject

ASSUMED = f"camera unknown; {DEFAULT_FOV:g} degrees from top to bottom are assumed (--fov, --intrinsics)"
"""The warning where nothing tells the camera."""


@dataclass(frozen=True, eq=False)
class PictureView:
    """One picture with its depths."""

    depth: Doubles
    """(H, W), along the camera's axis, NaN where there is nothing."""
    camera: Intrinsics
    colours: NDArray[np.uint8] | None
    """(H, W, 3), sRGB; None without a picture."""
    step: Doubles | float
    """To which the depths are rounded, as a share of them."""
    warning: str
    """What the user should know; empty where there is nothing."""

    def unprojected(self, close: bool) -> tuple[Cloud, Cut, float]:
        """Make the cloud, as `unproject` does. Returns it, what was cut, and the noise as a share of the depth."""
        cloud, cut, planes = unproject(self.depth, self.camera, self.colours, self.step, close=close)
        return cloud, cut, planes.noise


def read_view(options: UnprojectOptions) -> PictureView:
    """Read the files that the options name. Raises UserError."""
    option = "--image" if options.image else "--estimate"
    photograph = Path(path) if (path := options.image or options.estimate) else None
    picture = open_picture(photograph, option) if photograph else None
    values, inverse, whole = _values(options)
    height, width = values.shape
    depth = values
    if picture is not None:
        picture = fitted(picture, height, width, f"{option} {show(photograph or '')}")
        depth = _within(depth, solid(picture))
    if options.mask is not None:
        mask = fitted(open_picture(Path(options.mask), "--mask"), height, width, f"--mask {show(options.mask)}")
        depth = _within(depth, masked(mask))
    if np.isnan(depth).all():
        raise UserError("no pixel with a depth is left by the mask, or by the picture's transparency")
    if inverse:
        depth = from_inverse(depth, *(options.range or RELATIVE_RANGE))
    elif whole:
        depth = depth / options.unit
    step = step_share(values, depth, inverse)
    known = _camera(options, photograph, height, width)
    camera = known or of_view(DEFAULT_FOV, height, width)
    if options.ray:
        x, y = camera.plane(height, width)
        depth = depth / np.sqrt(1 + x**2 + y[:, None] ** 2)
    if options.range and not inverse:
        depth = _within(depth, (depth >= options.range[0]) & (depth <= options.range[1]))
        if np.isnan(depth).all():
            raise UserError("no depth lies within --range; the unit of whole numbers is that of --unit")
    return PictureView(depth, camera, None if picture is None else colours_of(picture), step, "" if known else ASSUMED)


def _values(options: UnprojectOptions) -> tuple[Doubles, bool, bool]:
    """Return the depths (H, W) as they were read or estimated, whether they are inverse, and whether whole numbers."""
    if options.depth is not None:
        values, whole = read_depth(Path(options.depth))
        return values, options.relative, whole
    assert options.estimate is not None
    photograph = open_picture(Path(options.estimate), "--estimate").convert("RGB")
    values, inverse = estimate_depth(photograph, options.estimator)
    return values, inverse or options.relative, False


def _within(depth: Doubles, mask: NDArray[np.bool_] | None) -> Doubles:
    return depth if mask is None else np.where(mask, depth, np.nan)


def _camera(options: UnprojectOptions, photograph: Path | None, height: int, width: int) -> Intrinsics | None:
    """Choose the camera: that of the options, or of the photograph's EXIF; None where nothing is known."""
    if options.intrinsics is not None:
        return of_file(Path(options.intrinsics), height, width)
    if options.fov is not None:
        return of_view(options.fov, height, width)
    return of_photograph(photograph, height, width) if photograph else None
