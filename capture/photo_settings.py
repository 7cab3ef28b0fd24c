"""The options of `photos`: what the verb and the function take alike, checked and made settings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

from ..model.errors import UserError
from ..model.orientation import UPRIGHT
from ..trainer.options import Numbers, is_duration, text_of
from ..trainer.settings import networks, omegas

DEFAULT_LEVELS = "64x2,128x2"
DEFAULT_STEPS = 6000
OMEGAS = "15,30,60"
"""omega_0 of levels 1, 2, ...; further levels take the last. A shape that is not known yet has to begin smooth."""
FIRST_BAND = 0.08
"""Half width of level 1's band, model units; each finer one is `NARROWER` times as wide."""
NARROWER = 0.4
RADIANCE = 128
"""Width of the radiance network."""
RAYS = 256
HELD_OUT = 10
WIDEST_RADIANCE, MOST_RAYS, MOST_STEPS = 1024, 65_536, 10_000_000
BACKGROUNDS = {"black": 0.0, "white": 1.0}


@dataclass(frozen=True)
class PhotoSettings:
    """The choices for one reconstruction from photographs; the model's provenance keeps them under these names."""

    levels: tuple[tuple[int, int], ...]
    """(width, depth) of each level, coarse to fine."""
    omegas: tuple[float, ...]
    """omega_0 of each level."""
    deltas: tuple[float, ...]
    """Half widths of the bands of all levels but the last, model units."""
    radiance: int
    """Width of the radiance network."""
    rays: int
    """Rays of a step."""
    steps: int | None
    """Optimiser steps; None: `seconds` count."""
    seconds: float | None
    """Wall time of the optimisation."""
    held_out: int
    """Every so-manieth photograph is kept out to measure by; 0: none."""
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


class PhotoOptions(TypedDict, total=False):
    """The arguments of `photo_settings` by name, for functions that pass them on; their defaults are there."""

    levels: str | Sequence[str] | None
    omega: Numbers | None
    """omega_0 of each level."""
    radiance: int
    """Width of the radiance network."""
    rays: int
    """Rays of a step."""
    seconds: float | None
    """Wall time of the optimisation, in place of `steps`."""
    steps: int | None
    held_out: int
    """Every so-manieth photograph is kept out to measure by; 0: none."""
    background: str
    """Of photographs without masks: "black" or "white"."""
    scale: float | None
    """Factor on the sides of the pictures."""
    camera_size: str | Sequence[int] | None
    """Width and height of the pictures that the cameras are for, "1600x1200"."""
    sphere: Numbers | None
    """Centre and radius of the ball that the object is in."""
    up: str | None
    """Axis of the cameras' space that points up."""
    credit: str | None
    seed: int
    device: str


def photo_settings(
    *,
    levels: str | Sequence[str] | None = None,
    omega: Numbers | None = None,
    radiance: int = RADIANCE,
    rays: int = RAYS,
    seconds: float | None = None,
    steps: int | None = None,
    held_out: int = HELD_OUT,
    background: str = "black",
    scale: float | None = None,
    camera_size: str | Sequence[int] | None = None,
    sphere: Numbers | None = None,
    up: str | None = None,
    credit: str | None = None,
    seed: int = 0,
    device: str = "auto",
) -> PhotoSettings:
    """Make the settings of the options of `mplicits photos`, which docs/capture.md explains. Raises UserError."""
    sizes = networks((levels if isinstance(levels, str) else ",".join(levels or ())) or DEFAULT_LEVELS)
    usual = [*OMEGAS.split(","), *[OMEGAS.rpartition(",")[2]] * len(sizes)][: len(sizes)]
    chosen = omegas(text_of(omega) or ",".join(usual), sizes)
    if len(chosen) != len(sizes):
        raise UserError(f"--omega: {len(chosen)} numbers for {len(sizes)} levels")
    if seconds is not None and steps is not None:
        raise UserError("--steps: not allowed with --seconds: it is the one or the other")
    if seconds is not None and not is_duration(seconds):
        raise UserError(f"--seconds: {seconds:g}: at least 1 is needed")
    for name, number, least, most in (
        ("--steps", DEFAULT_STEPS if steps is None else steps, 1, MOST_STEPS),
        ("--rays", rays, 16, MOST_RAYS),
        ("--radiance", radiance, 1, WIDEST_RADIANCE),
        ("--seed", seed, 0, 2**40),
    ):
        if not least <= number <= most:
            raise UserError(f"{name} {number}: a whole number from {least} to {most:,} is needed")
    if held_out < 0 or held_out == 1:
        raise UserError(f"--held-out {held_out}: 2 or more, or 0 for none")
    if background not in BACKGROUNDS:
        raise UserError(f"--background {background}: there is {', '.join(BACKGROUNDS)}")
    if scale is not None and not 0 < scale <= 1:
        raise UserError(f"--scale {scale:g}: above 0 and at most 1")
    if up is not None and up not in UPRIGHT:
        raise UserError(f"--up {up}: there is {', '.join(UPRIGHT)}")
    if device not in ("auto", "cpu", "cuda"):
        raise UserError(f"--device {device}: there is auto, cpu, cuda")
    return PhotoSettings(
        levels=sizes,
        omegas=chosen,
        deltas=tuple(FIRST_BAND * NARROWER**i for i in range(len(sizes) - 1)),
        radiance=radiance,
        rays=rays,
        steps=None if seconds is not None else steps or DEFAULT_STEPS,
        seconds=seconds,
        held_out=held_out,
        background=background,
        scale=scale,
        camera_size=_size(camera_size),
        sphere=_sphere(text_of(sphere)),
        up=up,
        credit=credit or "",
        seed=seed,
        device=device,
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
