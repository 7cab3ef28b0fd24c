"""Settings of one reconstruction from photographs."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..model.errors import UserError
from ..trainer.options import text_of
from ..trainer.settings import networks, omegas
from .options import PhotoOptions

OMEGAS = "15,30,60"
"""omega_0 of levels 1, 2, ...; further levels take the last. Low, since an unknown shape has to begin smooth."""
FIRST_BAND = 0.08
"""Band half-width delta of level 1, model units; that of each finer level is `NARROWER` times the one before."""
NARROWER = 0.4


@dataclass(frozen=True)
class PhotoSettings:
    """Settings of one reconstruction; the model's provenance has them under these names."""

    levels: tuple[tuple[int, int], ...]
    """(width, depth) of each level, coarse to fine."""
    omegas: tuple[float, ...]
    """omega_0 of each level."""
    deltas: tuple[float, ...]
    """Band half-width delta of each level but the last, model units."""
    radiance: int
    """Width of the radiance network."""
    rays: int
    """Rays of a step."""
    steps: int | None
    """Optimiser steps; None: `seconds` count."""
    seconds: float | None
    """Wall time of the optimisation."""
    held_out: int
    """Hold out every N-th photograph for evaluation; 0: none."""
    background: str
    """Of photographs without masks: "black" or "white"."""
    scale: float | None
    """Factor on the sides of the pictures; None: chosen by their number of pixels."""
    camera_size: tuple[int, int] | None
    """Width and height of the pictures that the cameras are for; None: those of the pictures."""
    sphere: tuple[float, float, float, float] | None
    """Centre and radius of the ball that the object is in; None: as the cameras have it."""
    up: str | None
    """Axis of the cameras' space that points up; None: as the pictures have it."""
    credit: str
    seed: int
    device: str
    """"auto", "cpu" or "cuda"."""


def photo_settings(options: PhotoOptions) -> PhotoSettings:
    """Return the settings of a reconstruction. Raises UserError."""
    levels = options.levels
    sizes = networks(levels if isinstance(levels, str) else ",".join(levels))
    usual = [*OMEGAS.split(","), *[OMEGAS.rpartition(",")[2]] * len(sizes)][: len(sizes)]
    chosen = omegas(text_of(options.omega) or ",".join(usual), sizes)
    if len(chosen) != len(sizes):
        raise UserError(f"--omega: {len(chosen)} numbers for {len(sizes)} levels")
    return PhotoSettings(
        levels=sizes,
        omegas=chosen,
        deltas=tuple(FIRST_BAND * NARROWER**i for i in range(len(sizes) - 1)),
        radiance=options.radiance,
        rays=options.rays,
        steps=None if options.seconds is not None else options.steps,
        seconds=options.seconds,
        held_out=options.held_out,
        background=options.background,
        scale=options.scale,
        camera_size=_size(options.camera_size),
        sphere=_sphere(text_of(options.sphere)),
        up=options.up,
        credit=options.credit or "",
        seed=options.seed,
        device=options.device,
    )


def _size(size: str | Sequence[int] | None) -> tuple[int, int] | None:
    """Read a size such as 1600x1200. Raises UserError."""
    if size is None:
        return None
    try:
        width, height = map(int, size.split("x") if isinstance(size, str) else size)
    except ValueError:
        width = height = 0
    if not 0 < min(width, height) <= max(width, height) < 1 << 16:
        raise UserError(f"--camera-size {size}: width and height in pixels, 1600x1200")
    return width, height


def _sphere(text: str | None) -> tuple[float, float, float, float] | None:
    """Read a centre and a radius. Raises UserError."""
    if text is None:
        return None
    try:
        x, y, z, radius = map(float, text.split(","))
    except ValueError:
        x = y = z = radius = 0.0
    if not (0 < radius < 1e12 and all(abs(number) < 1e12 for number in (x, y, z))):
        raise UserError(f"--sphere {text}: four numbers X,Y,Z,RADIUS with a radius above 0")
    return x, y, z, radius
