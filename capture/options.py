"""Options of `unproject` and `photos`. Loads nothing heavy: the command line declares them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..model.errors import UserError
from ..model.options import Options, argument, option
from ..model.orientation import UPRIGHT
from ..trainer.options import MOST_SECONDS, Numbers

DEFAULT_FOV = 50.0
"""Vertical field of view, degrees, of a picture with an unknown camera."""
RELATIVE_RANGE = (1.0, 2.5)
"""Depths of the nearest and the farthest pixel of a relative map: a shape that fills a picture of some 50 degrees."""
BACKGROUNDS = {"black": 0.0, "white": 1.0}


@dataclass(frozen=True)
class UnprojectOptions(Options):
    """Options of `unproject`, for the command line and for Python (docs/capture.md)."""

    depth: str | Path | None = argument(
        "DEPTH", "depth map: PNG of 8 or 16 bits, TIFF, EXR, NPY; 0: no depth", default=None
    )
    estimate: str | Path | None = option(
        None, "photograph in place of a depth map: a network estimates its depth", metavar="RGB"
    )
    estimator: str = option(
        "depth-anything/Depth-Anything-V2-Small-hf",
        "network that estimates depth: a folder, or a name on the Hugging Face hub, which the first use downloads",
        metavar="PATH|NAME",
    )
    image: str | Path | None = option(
        None, "the picture, for colors; its transparent pixels are left out", metavar="RGB"
    )
    mask: str | Path | None = option(
        None, "white, or opaque, where the shape is; all other pixels are left out", metavar="IMAGE"
    )
    fov: float | None = option(
        None,
        f"vertical field of view (default: from the picture's EXIF, or {DEFAULT_FOV:g})",
        metavar="DEG",
        excludes="intrinsics",
    )
    intrinsics: str | Path | None = option(
        None, "the camera: fx, fy, cx, cy in pixels, or a 3 x 3 matrix K", metavar="K.json"
    )
    relative: bool = option(False, "the map has inverse depths without a unit: larger is nearer")
    range: tuple[float, float] | None = option(
        None,
        "leave out other depths; with --relative, the depths of the nearest and the farthest pixel "
        f"(default: {RELATIVE_RANGE[0]:g},{RELATIVE_RANGE[1]:g})",
        metavar="NEAR,FAR",
    )
    unit: float = option(
        1000.0, "whole numbers of the map per unit of length, such as millimeters in a meter", metavar="N", above=0
    )
    ray: bool = option(False, "depths are along the pixels' rays, not along the camera's axis")
    close: bool = option(False, "add a plausible unseen side: the visible one, mirrored behind the outline")

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.depth is None) == (self.estimate is None):
            raise UserError("name a depth map, or a photograph with --estimate, and not both")
        if self.range is not None and not 0 < self.range[0] < self.range[1] < math.inf:
            near, far = self.range
            raise UserError(f"--range {near:g},{far:g}: two numbers NEAR,FAR with 0 < NEAR < FAR are needed")


@dataclass(frozen=True)
class PhotoOptions(Options):
    """Options of `photos`, for the command line and for Python (docs/capture.md)."""

    levels: str | Sequence[str] = option(
        "64x2,128x2", "width and hidden layers of each level, coarse to fine", metavar="NxD,.."
    )
    omega: Numbers | None = option(None, "omega_0 of each level (default: 15, 30, then 60)", metavar="W,..")
    radiance: int = option(128, "width of the radiance network", metavar="N", least=1, most=1024)
    rays: int = option(256, "rays of a step", metavar="N", least=16, most=65_536)
    seconds: float | None = option(
        None,
        "wall time of the optimization, in place of --steps",
        metavar="S",
        least=1,
        most=MOST_SECONDS,
    )
    steps: int = option(6000, "optimizer steps", metavar="N", least=1, most=10_000_000, excludes="seconds")
    held_out: int = option(
        10, "hold out every K-th photograph for evaluation, and print its PSNR; 0: none", metavar="K", least=0
    )
    background: str = option("black", "background of photographs without masks", choices=tuple(BACKGROUNDS))
    scale: float | None = option(
        None, "factor on the pictures' sides (default: 4 million pixels in all)", metavar="S", above=0, most=1
    )
    camera_size: str | Sequence[int] | None = option(
        None, "size of the pictures for which cameras_sphere.npz was made, if yours are smaller", metavar="WxH"
    )
    sphere: Numbers | None = option(
        None,
        "with a transforms.json: ball that contains the object (default: the region that all cameras see)",
        metavar="X,Y,Z,R",
    )
    up: str | None = option(
        None, "axis of the cameras' space that points up (default: as in the pictures)", choices=UPRIGHT
    )
    credit: str | None = option(None, "author and license of the photographs", metavar="TEXT")
    seed: int = option(0, "seed of all random numbers", metavar="K", least=0, most=2**40)
    device: str = option("auto", "where to train; auto: a CUDA device if there is one", choices=("auto", "cpu", "cuda"))
    quiet: bool = option(False, "show no progress bar")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.held_out == 1:
            raise UserError("--held-out 1: 2 or more, or 0 for none")
