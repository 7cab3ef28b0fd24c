"""The settings of one training, and the parsing of their texts on the command line. Nothing here needs torch."""

import math
import re
from dataclasses import dataclass, field

from ..model.errors import UserError
from ..model.orientation import check_front
from .config import LossWeights, default_config


@dataclass(frozen=True)
class Preset:
    """Levels with a name."""

    levels: str
    """In the form of --levels."""
    packed: bool = False
    """Whether weights are quantized (model/quantize.py), for short Shadertoy texts."""


PRESETS = {
    "tiny": Preset("20x1,16x2", packed=True),
    "small": Preset("32x1,48x2", packed=True),
    "base": Preset("48x1,64x4"),
    "paper": Preset("64x2,128x2,256x2"),
}
DEFAULT_PRESET = "base"
WIDEST, DEEPEST, MOST_LEVELS = 1024, 8, 8
"""Limits of --levels."""
LARGEST = 1e12
"""Limit of numbers on the command line."""


@dataclass(frozen=True)
class Settings:
    """The settings of one training; the model's provenance stores them under these names."""

    networks: tuple[tuple[int, int], ...]
    """(width, depth) of each level, coarse to fine."""
    omegas: tuple[float, ...]
    """omega_0 of each level, and of the texture unless it is the default."""
    steps: tuple[int, ...]
    """Optimizer steps of each level, then of the texture."""
    seconds: float | None = None
    """Wall time of the whole training, in place of `steps`."""
    texture: bool = True
    """Whether to learn the colors of a shape that has some."""
    seed: int = 0
    device: str = "auto"
    """"auto", "cpu" or "cuda"."""
    weights: dict[str, float] = field(default_factory=dict)
    """Loss weights of the user, by the names of `LossWeights`."""
    packed: bool = False
    """Whether weights are quantized in every step (networks/quantized.py)."""
    texture_network: tuple[int, int] | None = None
    """(width, depth) of the texture; None: by the size of the last level."""
    noise: float | None = None
    """Standard deviation of a cloud's points, as a share of the shape's radius; None: measure it."""
    up: str | None = None
    """Axis of the shape's file that points up; None: that of the file's format, or y."""
    front: tuple[float, float] | None = None
    """`Model.front`."""
    credit: str = ""
    """`Model.credit`."""

    def texture_size(self) -> tuple[int, int]:
        """Return (width, depth) of the texture network: the user's, or the default."""
        return self.texture_network or default_texture(self.networks[-1])

    def texture_omega(self) -> float:
        """Return omega_0 of the texture network."""
        own = self.omegas[len(self.networks) :]
        return own[0] if own else default_config().lengths.texture_omega


def default_texture(last: tuple[int, int]) -> tuple[int, int]:
    """Return the default (width, depth) of a texture network: that of the last level, up to a limit."""
    (width, depth), (widest, deepest) = last, default_config().lengths.texture_network
    return min(width, widest), min(depth, deepest)


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
    """Parse omega_0 of each level, and optionally of the texture: `30,60` -> (30.0, 60.0).

    text: None for the default. sizes: (width, depth) of each level. Raises UserError.
    """
    count = len(sizes)
    if text is None:
        return tuple(default_omega(i, width) for i, (width, _) in enumerate(sizes))
    values = _numbers("--omega", text)
    if len(values) not in (count, count + 1) or min(values) <= 0:
        raise UserError(
            f"--omega: {text!r}: {count} positive numbers are needed, one for each level (and one more for the texture)"
        )
    return tuple(values)


def default_omega(index: int, width: int) -> float:
    """Return the default omega_0 of level `index`, from 0."""
    lengths = default_config().lengths
    omega = lengths.omegas[min(index, len(lengths.omegas) - 1)]
    return round(omega * min(1.0, math.sqrt(width / lengths.omega_width)), 1)


def steps(text: str | None, count: int) -> tuple[int, ...]:
    """Parse the steps of `count` levels and of the texture: `1500,6000` -> (1500, 6000, 6000), the last one repeated.

    text: None for the defaults. Raises UserError.
    """
    if text is None:
        lengths = default_config().lengths
        return (*(lengths.steps[min(i, 1)] for i in range(count)), lengths.texture_steps)
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
