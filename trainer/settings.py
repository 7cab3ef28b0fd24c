"""What a user may choose of a training, the defaults, and the parsing of the command line's texts."""

import re
from dataclasses import dataclass, field, replace

from ..model.errors import UserError
from ..model.orientation import check_front


@dataclass(frozen=True)
class Preset:
    """A choice of levels that has a name."""

    levels: str
    """As --levels takes them."""
    packed: bool = False
    """Whether weights are quantised (model/quantise.py), for short Shadertoy texts."""


PRESETS = {
    "tiny": Preset("20x1,16x2", packed=True),
    "small": Preset("32x1,48x2", packed=True),
    "base": Preset("48x1,64x4"),
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
"""Largest texture network that is chosen without --texture-network."""
WIDEST, DEEPEST, MOST_LEVELS = 1024, 8, 8
"""Limits of what the command line takes."""
OMEGA_WIDTH = 64
"""Width of a network below which the default omega_0 is lower."""
LARGEST = 1e12
"""Numbers on the command line are smaller than this."""


@dataclass(frozen=True)
class LossWeights:
    """Factors of the terms of a level's loss (Eq. 4)."""

    value: float
    """Of the values on the surface."""
    normal: float
    eikonal: float
    distance: float
    """Of the values off the surface, where the exact distance is known."""
    excess: float = 1.0
    """Times `distance`, where a value off the surface exceeds the distance."""
    lacking: float = 1.0
    """Times `distance`, where it has less than losses.LACK of the distance, or the wrong sign."""
    length: float = 1.0
    """Times `eikonal`, at points of the surface; of a cloud at the beginning, where the user does not give it."""
    near: float = 0.008
    """Closer than this to the surface, model units, a value that exceeds the distance weighs like any other."""


FIRST_LEVEL = LossWeights(value=10_000.0, normal=30.0, eikonal=1.0, distance=3000.0, excess=20.0, lacking=1.0)
"""Level 1 has to be a distance in the whole domain."""
RESIDUAL = LossWeights(
    value=300_000.0, normal=100.0, eikonal=3.0, distance=3000.0, excess=40.0, lacking=20.0, near=0.003
)
"""A residual spends what it can hold on the surface."""
LATE, LATE_VALUE = 0.85, 10.0
"""Share of the schedule from which values on a mesh's surface weigh more, and how many times: the surface comes nearer
then, where the same weight from the beginning would make f flat there."""
NOISY_FIRST_VALUE, NOISY_VALUE = 0.3, 3.0
"""The most that `value` is of level 1 and of a residual, times the variance of the points' noise.

What the removal of noise has left of it makes f flat where the value term outweighs the Eikonal term.
"""
NOISY_EIKONAL = 20.0
"""`eikonal` of a residual where there is noise."""
CLOUD_LENGTH = 15.0
"""`length` of a residual of a cloud without noise, at least: review.py raises it where |grad f| is not in 0.8 to 1.2 on
90 % of the surface."""
MOVING_EIKONAL = 45.0
"""`eikonal` of a shape that moves: fronts that meet, and limbs that vanish, would leave flat places."""


@dataclass(frozen=True)
class Wish:
    """What the levels that `--levels auto` chooses are to reach; one of the two is None."""

    parameters: int | None
    """Most parameters of the model, its texture included."""
    error: float | None
    """Mean |f| of the last level on the surface, model units."""


@dataclass(frozen=True)
class Settings:
    """The choices for one training; the model's provenance keeps them under these names."""

    networks: tuple[tuple[int, int], ...]
    """(width, depth) of each level, coarse to fine."""
    omegas: tuple[float, ...]
    """omega_0 of each level, and of the texture where it is not the default."""
    steps: tuple[int, ...]
    """Optimiser steps of each level, then of the texture."""
    seconds: float | None = None
    """Wall time of the whole training, in place of `steps`."""
    texture: bool = True
    """Whether colours are learnt, where the shape has them."""
    seed: int = 0
    device: str = "auto"
    """"auto", "cpu" or "cuda"."""
    weights: dict[str, float] = field(default_factory=dict)
    """Those of `LossWeights` that are not the default, by name."""
    wish: Wish | None = None
    """What `networks` and `omegas` are yet to be chosen by, or were; None: the user has chosen them."""
    packed: bool = False
    """Whether weights are quantised in every step (networks/quantized.py)."""
    texture_network: tuple[int, int] | None = None
    """(width, depth) of the texture; None: chosen by the last level's."""
    noise: float | None = None
    """Standard deviation of a cloud's points, as a share of the shape's radius; None: measured."""
    up: str | None = None
    """Axis of the shape's file that points up; None: as the file's format says, or y."""
    front: tuple[float, float] | None = None
    """Kept in the model (`Model.front`), as is `credit`."""
    credit: str = ""

    def texture_size(self) -> tuple[int, int]:
        """Choose (width, depth) of the texture network: what was asked for, or the usual one."""
        return self.texture_network or usual_texture(self.networks[-1])

    def texture_omega(self) -> float:
        """Choose omega_0 of the texture network."""
        given = self.omegas[len(self.networks) :]
        return given[0] if given else TEXTURE_OMEGA

    def loss_weights(
        self, first: bool, noise: float = 0.0, *, cloud: bool = False, moving: bool = False
    ) -> LossWeights:
        """Choose the loss weights of level 1, or of a residual: the defaults, changed by `weights`.

        noise: standard deviation of the noise that was removed from the shape's points, model units. cloud: whether
        the shape is known by points alone. moving: whether it moves.
        """
        usual = FIRST_LEVEL if first else RESIDUAL
        if noise:
            most = (NOISY_FIRST_VALUE if first else NOISY_VALUE) / noise**2
            eikonal = usual.eikonal if first else NOISY_EIKONAL
            usual = replace(usual, value=min(usual.value, most), eikonal=eikonal, near=FIRST_LEVEL.near)
        elif cloud and not first:
            usual = replace(usual, length=CLOUD_LENGTH)
        if moving:
            usual = replace(usual, eikonal=MOVING_EIKONAL)
        return replace(usual, **self.weights)


def usual_texture(last: tuple[int, int]) -> tuple[int, int]:
    """Choose (width, depth) of a texture network: that of the last level within limits."""
    width, depth = last
    return min(width, TEXTURE_WIDEST), min(depth, TEXTURE_DEEPEST)


def networks(text: str, option: str = "--levels") -> tuple[tuple[int, int], ...]:
    """Parse the sizes of networks: `64x1,64x2` -> ((64, 1), (64, 2)), (N, d) in the paper's notation.

    option: the option's name for error messages. Raises UserError.
    """
    sizes = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,5})x(\d{1,3})\s*", part, re.ASCII)
        if not match or not 1 <= int(match[1]) <= WIDEST or int(match[2]) > DEEPEST:
            raise UserError(f"{option}: {part!r} is not NxD (64x1) with N up to {WIDEST}, D up to {DEEPEST}")
        sizes.append((int(match[1]), int(match[2])))
    if len(sizes) > MOST_LEVELS:
        raise UserError(f"{option}: {len(sizes)} levels; at most {MOST_LEVELS}")
    return tuple(sizes)


def omegas(text: str | None, sizes: tuple[tuple[int, int], ...]) -> tuple[float, ...]:
    """Parse omega_0 of each level, and of the texture where it is given: `30,60` -> (30.0, 60.0).

    text: None for the defaults: `OMEGAS`, lowered for narrow networks in proportion to the root of the width, since
    they have too few sines to fill the spectrum. sizes: (width, depth) of each level. Raises UserError.
    """
    count = len(sizes)
    if text is None:
        return tuple(
            round(OMEGAS[min(i, len(OMEGAS) - 1)] * min(1, (width / OMEGA_WIDTH) ** 0.5), 1)
            for i, (width, _) in enumerate(sizes)
        )
    values = _numbers("--omega", text)
    if len(values) not in (count, count + 1) or min(values) <= 0:
        raise UserError(
            f"--omega: {text!r}: {count} positive numbers are needed, one for each level (and one more for the texture)"
        )
    return tuple(values)


def steps(text: str | None, count: int) -> tuple[int, ...]:
    """Parse the steps of `count` levels and of the texture: `1500,6000` -> (1500, 6000, 6000), the last one repeated.

    text: None for the defaults. Raises UserError.
    """
    if text is None:
        return (*(STEPS[min(i, 1)] for i in range(count)), TEXTURE_STEPS)
    numbers = _numbers("--steps", text)
    if len(numbers) > count + 1 or min(numbers) < 1 or any(n != int(n) for n in numbers):
        raise UserError(f"--steps: {text!r}: whole numbers from 1 are needed, one a level and one for the texture")
    return tuple(int(numbers[min(i, len(numbers) - 1)]) for i in range(count + 1))


def loss_weights(text: str | None) -> dict[str, float]:
    """Parse weights of the loss: `value=3000,normal=100` -> {"value": 3000.0, "normal": 100.0}. Raises UserError."""
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


def front(text: str | None) -> tuple[float, float] | None:
    """Parse the first view of a model: `215,15` -> (215.0, 15.0), degrees around and above. Raises UserError."""
    if text is None:
        return None
    angles = tuple(_numbers("--front", text))
    try:
        check_front(angles)
    except UserError as error:
        raise UserError(f"--{error}") from None
    azimuth, elevation = angles
    return azimuth, elevation


def _numbers(option: str, text: str) -> list[float]:
    """Parse numbers joined by commas. option: its name for error messages. Raises UserError."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise UserError(f"{option}: {text!r} is not a number, or numbers with commas between") from None
    if not all(abs(number) < LARGEST for number in numbers):
        raise UserError(f"{option}: {text!r}: too large, or not finite")
    return numbers
