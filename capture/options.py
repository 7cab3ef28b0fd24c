"""Options of `unproject` and `photos`, for the command line and for Python (docs/capture.md)."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import show
from ..model.options import Options, argument, declarations, option
from ..model.orientation import UPRIGHT
from ..model.references import follow_option
from ..trainer.options import MOST_SECONDS, Numbers, text_of
from ..trainer.settings import networks, omegas

DEFAULT_FOV = 50.0  # vertical field of view, degrees, of a picture without a known camera
RELATIVE_RANGE = (1.0, 2.5)
"""Depths of the nearest and the farthest pixel of a relative map: a shape that fills a view of some 50 degrees."""
BACKGROUNDS = {"black": 0.0, "white": 1.0}
OMEGAS = "15,30,60"
"""omega_0 of levels 1, 2, ...; further levels use the last one. An unknown shape has to start smooth."""
FIRST_DELTA, NARROWER = 0.08, 0.4
"""Band half-width delta of level 1, model units, and the ratio of each finer level's delta to the one before."""


@dataclass(frozen=True)
class UnprojectOptions(Options):
    """Options of `unproject`."""

    depth: str | Path | None = argument(
        "DEPTH", "depth map: PNG of 8 or 16 bits, TIFF, EXR, NPY; 0: no depth", default=None
    )
    estimate: str | Path | None = option(
        None, "photograph in place of a depth map: a network estimates its depth", metavar="RGB"
    )
    estimator: str = option(
        "depth-anything/Depth-Anything-V2-Small-hf",
        "network for --estimate: a folder, or a name on the Hugging Face hub, downloaded at the first use",
        metavar="PATH|NAME",
        study=True,
    )
    image: str | Path | None = option(
        None, "picture with the colors; its transparent pixels are left out", metavar="RGB"
    )
    mask: str | Path | None = option(
        None, "white, or opaque, where the shape is; other pixels are left out", metavar="IMAGE"
    )
    fov: float | None = option(
        None,
        f"vertical field of view (default: from the picture's EXIF, or {DEFAULT_FOV:g})",
        metavar="DEG",
        least=1,
        most=150,
    )
    intrinsics: str | Path | None = option(
        None, "camera file: fx, fy, cx, cy in pixels, or a 3 x 3 matrix K", metavar="K.json", excludes="fov"
    )
    relative: bool = option(False, "the map stores inverse depths without a unit: larger is nearer")
    range: tuple[float, float] | None = option(
        None,
        "leave out depths outside; with --relative, depths of the nearest and the farthest pixel "
        f"(default: {RELATIVE_RANGE[0]:g},{RELATIVE_RANGE[1]:g})",
        metavar="NEAR,FAR",
    )
    unit: float = option(
        1000.0, "integer depths per unit of length: millimeters to meters by default", metavar="N", above=0
    )
    ray: bool = option(False, "depths are distances along the pixels' rays, not along the camera's axis")
    close: bool = option(False, "add a plausible back side: the front, mirrored behind the outline and smoothed")

    def __post_init__(self) -> None:
        """Raise UserError for options that contradict one another."""
        super().__post_init__()
        if (self.depth is None) == (self.estimate is None):
            raise UserError("name a depth map, or a photograph with --estimate, and not both")
        if self.range is not None and not 0 < self.range[0] < self.range[1] < math.inf:
            near, far = self.range
            raise UserError(f"--range {near:g},{far:g}: two numbers NEAR,FAR with 0 < NEAR < FAR are needed")

    def inputs(self) -> list[Path]:
        """Return the paths of the files to read."""
        paths = (self.depth, self.estimate, self.image, self.mask, self.intrinsics)
        return [Path(path) for path in paths if path is not None]


@dataclass(frozen=True)
class PhotoOptions(Options):
    """Options of `photos`."""

    levels: str | Sequence[str] = option(
        "64x2,128x2", "width and hidden layers of each level, coarse to fine", metavar="NxD,.."
    )
    omega: Numbers | None = option(None, "omega_0 of each level (default: 15, 30, then 60)", metavar="W,..", study=True)
    radiance: int = option(128, "width of the radiance network", metavar="N", least=1, most=1024, study=True)
    rays: int = option(256, "rays per step", metavar="N", least=16, most=65_536, study=True)
    seconds: float | None = option(None, "training time, in place of --steps", metavar="S", least=1, most=MOST_SECONDS)
    steps: int = option(6000, "optimizer steps", metavar="N", least=1, most=10_000_000, excludes="seconds")
    held_out: int = option(
        10, "hold out every K-th photograph for evaluation, and print its PSNR; 0: none", metavar="K", least=0
    )
    background: str = option(
        "black", "color behind the object in photographs without masks", choices=tuple(BACKGROUNDS)
    )
    scale: float | None = option(
        None, "factor on the photographs' sides (default: 4 million pixels in all)", metavar="S", above=0, most=1
    )
    camera_size: str | Sequence[int] | None = option(
        None,
        "size of the photographs that cameras_sphere.npz describes, if yours are smaller",
        metavar="WxH",
        study=True,
    )
    sphere: Numbers | None = option(
        None,
        "with a transforms.json: center and radius of a ball around the object (default: what all cameras see)",
        metavar="X,Y,Z,R",
    )
    up: str | None = option(
        None, "axis of the cameras' space that points up (default: as in the photographs)", choices=tuple(UPRIGHT)
    )
    credit: str = option("", "author and license of the photographs", metavar="TEXT")
    seed: int = option(0, "seed of all random numbers", metavar="K", least=0, most=2**40)
    device: str = option("auto", "where to train; auto: a CUDA device if there is one", choices=("auto", "cpu", "cuda"))
    quiet: bool = option(False, "show no progress bar")
    follow: bool = follow_option()

    def __post_init__(self) -> None:
        """Raise UserError for a bad value."""
        super().__post_init__()
        self.record()  # checks every value
        if len(self.omegas) != len(self.sizes):
            raise UserError(f"--omega: {len(self.omegas)} numbers for {len(self.sizes)} levels")
        if self.held_out == 1:
            raise UserError("--held-out 1: 2 or more, or 0 for none")

    @property
    def sizes(self) -> tuple[tuple[int, int], ...]:
        """(width, depth) of each level. Raises UserError."""
        return networks(self.levels if isinstance(self.levels, str) else ",".join(self.levels))

    @property
    def omegas(self) -> tuple[float, ...]:
        """omega_0 of each level. Raises UserError."""
        defaults = OMEGAS.split(",")
        chosen = text_of(self.omega) or ",".join((defaults + defaults[-1:] * len(self.sizes))[: len(self.sizes)])
        return omegas(chosen, self.sizes)

    @property
    def deltas(self) -> tuple[float, ...]:
        """Band half-widths of all levels, model units."""
        return tuple(FIRST_DELTA * NARROWER**i for i in range(len(self.sizes)))

    @property
    def ball(self) -> tuple[float, float, float, float] | None:
        """Center and radius of --sphere. Raises UserError."""
        if self.sphere is None:
            return None
        try:
            x, y, z, radius = map(float, (text_of(self.sphere) or "").split(","))
        except ValueError:
            x = y = z = radius = 0.0
        if not (radius > 1e-12 and max(map(abs, (x, y, z, radius))) < 1e12):
            raise UserError(
                f"--sphere {show(str(self.sphere))}: four numbers X,Y,Z,RADIUS with a radius above 0 are needed"
            )
        return x, y, z, radius

    @property
    def picture_size(self) -> tuple[int, int] | None:
        """Width and height of --camera-size. Raises UserError."""
        size = self.camera_size
        if size is None:
            return None
        try:
            width, height = map(int, size.split("x") if isinstance(size, str) else size)
        except ValueError:
            width = height = 0
        if not 0 < min(width, height) <= max(width, height) < 1 << 16:
            raise UserError(f"--camera-size {show(str(size))}: width and height in pixels are needed, 1600x1200")
        return width, height

    def record(self) -> dict[str, Any]:
        """Return the settings as the model's provenance stores them, in JSON's types."""
        names = declarations(PhotoOptions).keys() - {
            "levels",
            "omega",
            "steps",
            "sphere",
            "camera_size",
            "quiet",
            "follow",
        }
        settings = {
            "levels": self.sizes,
            "omegas": self.omegas,
            "deltas": self.deltas[:-1],
            "steps": None if self.seconds else self.steps,
            "sphere": self.ball,
            "camera_size": self.picture_size,
            **{name: getattr(self, name) for name in sorted(names)},
        }
        stored: dict[str, Any] = json.loads(json.dumps(settings))
        return stored
