"""What a user may choose, and the defaults; the texts of the command line parsed."""

import re
from dataclasses import dataclass, field, replace

from ..model.errors import UserError


@dataclass(frozen=True)
class Preset:
    """levels: as --levels takes them. packed: weights on the grids that Shadertoy texts are packed on."""

    levels: str
    packed: bool = False


PRESETS = {
    "tiny": Preset("20x1,16x2", packed=True),
    "small": Preset("32x1,48x2", packed=True),
    "base": Preset("64x1,64x2,64x2"),
    "paper": Preset("64x2,128x2,256x2"),
}
DEFAULT_PRESET = "base"
OMEGAS = (40.0, 80.0, 120.0)
"""omega_0 of levels 1, 2, ... that are 64 wide or wider; further levels take the last."""
STEPS = (4000, 10_000)
"""Optimiser steps of level 1 and of each finer level."""
TEXTURE_STEPS = 2000
TEXTURE_OMEGA = 50.0
TEXTURE_WIDEST, TEXTURE_DEEPEST = 64, 2
WIDEST, DEEPEST, MOST = 1024, 8, 8


@dataclass(frozen=True)
class LossWeights:
    """Factors of the loss: the three terms of Eq. 4, and `distance` of the values off the surface."""

    value: float
    normal: float
    eikonal: float
    distance: float


FIRST_LEVEL = LossWeights(value=30_000.0, normal=100.0, eikonal=10.0, distance=3000.0)
"""Level 1 has to be a distance in the whole domain."""
RESIDUAL = LossWeights(value=300_000.0, normal=100.0, eikonal=3.0, distance=3000.0)
"""A residual spends what it can hold on the surface."""


@dataclass(frozen=True)
class Settings:
    """networks: (width, depth) of each level. omegas: omega_0 of each, then of the texture, or its default.

    steps: of each level, then of the texture. seconds: wall time of the whole training, in place of `steps`, or None.
    weights: of the loss, where not default. packed: weights on grids of 6 bits (rounding.py). texture_network: its
    (width, depth), or its default.
    """

    networks: tuple[tuple[int, int], ...]
    omegas: tuple[float, ...]
    steps: tuple[int, ...]
    seconds: float | None = None
    texture: bool = True
    seed: int = 0
    device: str = "auto"
    weights: dict[str, float] = field(default_factory=dict)
    packed: bool = False
    texture_network: tuple[int, int] | None = None

    def texture_size(self) -> tuple[int, int]:
        """(width, depth) of the texture network: that of the last level, within limits."""
        width, depth = self.networks[-1]
        return self.texture_network or (min(width, TEXTURE_WIDEST), min(depth, TEXTURE_DEEPEST))

    def texture_omega(self) -> float:
        """omega_0 of the texture network."""
        given = self.omegas[len(self.networks) :]
        return given[0] if given else TEXTURE_OMEGA

    def loss_weights(self, first: bool) -> LossWeights:
        """Those of level 1 or of a residual: the defaults, changed by `weights`."""
        return replace(FIRST_LEVEL if first else RESIDUAL, **self.weights)


def networks(text: str, option: str = "--levels") -> tuple[tuple[int, int], ...]:
    """`64x1,64x2` -> ((64, 1), (64, 2)): (N, d) in the paper's notation. Raises UserError."""
    found = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,5})x(\d{1,3})\s*", part, re.ASCII)
        if not match or not 1 <= int(match[1]) <= WIDEST or int(match[2]) > DEEPEST:
            raise UserError(f"{option}: {part!r} is not NxD (64x1) with N up to {WIDEST}, D up to {DEEPEST}")
        found.append((int(match[1]), int(match[2])))
    if len(found) > MOST:
        raise UserError(f"{option}: {len(found)} levels; at most {MOST}")
    return tuple(found)


def omegas(text: str | None, sizes: tuple[tuple[int, int], ...]) -> tuple[float, ...]:
    """`30,60` -> one omega_0 a level, and that of the texture where it is given. Raises UserError.

    By default `OMEGAS`, less for narrow networks, which have too few sines to fill the spectrum: as the root of width.
    """
    count = len(sizes)
    if text is None:
        return tuple(
            round(OMEGAS[min(i, len(OMEGAS) - 1)] * min(1, (width / 64) ** 0.5), 1)
            for i, (width, _) in enumerate(sizes)
        )
    found = _numbers("--omega", text)
    if len(found) not in (count, count + 1) or min(found) <= 0:
        raise UserError(
            f"--omega: {text!r}: {count} positive numbers are needed, one for each level (and one more for the texture)"
        )
    return tuple(found)


def steps(text: str | None, count: int) -> tuple[int, ...]:
    """`1500,6000` -> steps of `count` levels and the texture; the last number repeats. Raises UserError."""
    if text is None:
        return (*(STEPS[min(i, 1)] for i in range(count)), TEXTURE_STEPS)
    found = _numbers("--steps", text)
    if len(found) > count + 1 or min(found) < 1 or any(n != int(n) for n in found):
        raise UserError(f"--steps: {text!r}: whole numbers from 1 are needed, one a level and one for the texture")
    return tuple(int(found[min(i, len(found) - 1)]) for i in range(count + 1))


def loss_weights(text: str | None) -> dict[str, float]:
    """`value=3000,normal=100` -> the weights it names. Raises UserError."""
    known = LossWeights.__dataclass_fields__
    chosen: dict[str, float] = {}
    for part in text.split(",") if text else []:
        key, _, number = part.strip().partition("=")
        if key not in known:
            raise UserError(f"--weights: {part!r}: NAME=NUMBER with a NAME of {', '.join(known)} is needed")
        chosen[key] = _numbers(f"--weights {key}", number)[0]
        if chosen[key] < 0:
            raise UserError(f"--weights: {part!r}: must not be negative")
    return chosen


def _numbers(option: str, text: str) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        raise UserError(f"{option}: {text!r} is not a number, or numbers with commas between") from None
    if not all(abs(number) < 1e12 for number in found):
        raise UserError(f"{option}: {text!r}: too large, or not finite")
    return found
