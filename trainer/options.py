"""The options of a training: what the verb `train` and the function `train` take alike, checked and made `Settings`."""

from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, signature
from typing import TypedDict, TypeVar

from ..model.errors import UserError
from ..model.orientation import check_up
from . import settings as parse
from .automatic_wish import wish_of
from .settings import DEFAULT_PRESET, PRESETS, Settings, networks

LARGEST_NOISE = 0.1
"""Largest standard deviation of a cloud's points that is taken, as a share of the shape's radius."""
MOST_SECONDS = 1e7
"""A training takes less: some 116 days."""
THINNEST = 0.001
"""Least that thicken takes: a thinner sheet is thinner than what a network resolves."""
AUTOMATIC = "auto"
"""Value of levels that has them chosen for the shape."""
CREASE = 30.0
"""Angle in degrees above which an edge of a mesh may be a crease."""

Numbers = str | Sequence[float] | float
"""Numbers joined by commas, as on the command line, or as such."""


def is_duration(seconds: float) -> bool:
    """Whether a training may take so many seconds."""
    return 1 <= seconds < MOST_SECONDS


class TrainingOptions(TypedDict, total=False):
    """The arguments of `settings_from` by name, for functions that pass them on; their defaults are there."""

    parameters: int | None
    """Most parameters of the model, for levels "auto"."""
    kilobytes: float | None
    """Size of the model file, likewise."""
    error: float | None
    """Mean |f| on the surface that is to be reached, likewise."""
    preset: str
    """Levels by name: one of `PRESETS`."""
    packed: bool
    omega: Numbers | None
    """omega_0 of each level, and of the texture."""
    seconds: float | None
    """Wall time of all of it, in place of `steps`."""
    steps: Numbers | None
    """Optimiser steps of each level, then of the texture."""
    texture: str
    """"auto", "none", or the path of an image."""
    texture_network: str | None
    """Its size, as "64x2"."""
    crease: float
    """Degrees above which an edge of a mesh may be a crease."""
    thicken: float | None
    noise: float | None
    up: str | None
    front: Numbers | None
    credit: str | None
    seed: int
    device: str
    weights: str | Mapping[str, float] | None


def settings_from(
    levels: str | Sequence[str] | None = None,
    *,
    parameters: int | None = None,
    kilobytes: float | None = None,
    error: float | None = None,
    preset: str = DEFAULT_PRESET,
    packed: bool = False,
    omega: Numbers | None = None,
    seconds: float | None = None,
    steps: Numbers | None = None,
    texture: str = "auto",
    texture_network: str | None = None,
    crease: float = CREASE,
    thicken: float | None = None,
    noise: float | None = None,
    up: str | None = None,
    front: Numbers | None = None,
    credit: str | None = None,
    seed: int = 0,
    device: str = "auto",
    weights: str | Mapping[str, float] | None = None,
) -> Settings:
    """Make the settings of a training of its options, which docs/training.md explains. Raises UserError."""
    if preset not in PRESETS:
        raise UserError(f"--preset {preset}: there is {', '.join(PRESETS)}")
    chosen = PRESETS[preset]
    named = levels if isinstance(levels, str) else ",".join(levels or ())
    wish = wish_of(parameters, kilobytes, error, automatic=named == AUTOMATIC)
    if wish is not None and not (omega is None and steps is None and not packed):
        raise UserError(f"--levels {AUTOMATIC}: not with --omega, --steps or --packed: it chooses them itself")
    sizes = networks((not wish and named) or chosen.levels)
    if seconds is not None and not is_duration(seconds):
        raise UserError(f"--seconds: {seconds:g}: at least 1 is needed")
    if seconds is not None and steps is not None:
        raise UserError("--steps: not allowed with --seconds: it is the one or the other")
    if noise is not None and not 0 <= noise <= LARGEST_NOISE:
        raise UserError(f"--noise: {noise:g}: a share of the radius from 0 to {LARGEST_NOISE} is needed")
    if not 0 <= seed < 2**40:
        raise UserError(f"--seed: {seed}: a whole number from 0 is needed")
    if thicken is not None and not THINNEST <= thicken <= 1:
        raise UserError(f"--thicken: {thicken:g}: a share of the radius from {THINNEST} to 1 is needed")
    if not 0 <= crease <= 180:
        raise UserError(f"--crease: {crease:g}: an angle from 0 to 180 degrees is needed")
    if up is not None:
        check_up(up)
    if device not in ("auto", "cpu", "cuda"):
        raise UserError(f"--device {device}: there is auto, cpu, cuda")
    if isinstance(weights, Mapping):
        weights = ",".join(f"{name}={number}" for name, number in weights.items())
    return Settings(
        networks=sizes,
        wish=wish,
        omegas=parse.omegas(text_of(omega), sizes),
        steps=parse.steps(text_of(steps), len(sizes)),
        seconds=seconds,
        texture=texture != "none",
        seed=seed,
        device=device,
        weights=parse.loss_weights(weights),
        packed=packed or (chosen.packed and not named),
        texture_network=networks(texture_network, "--texture-network")[0] if texture_network else None,
        noise=noise,
        up=up,
        front=parse.front(text_of(front)),
        credit=credit or "",
    )


Takes = TypeVar("Takes", bound=Callable[..., object])


def shows_options(taker: Callable[..., object]) -> Callable[[Takes], Takes]:
    """Show the arguments of `taker`, with their defaults, in the signature of a function that hands it `**options`."""

    def show(function: Takes) -> Takes:
        own = [each for each in signature(function).parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
        names = {each.name for each in own}
        more = [
            each.replace(kind=Parameter.KEYWORD_ONLY)
            for name, each in signature(taker).parameters.items()
            if name not in names
        ]
        function.__signature__ = signature(function).replace(parameters=[*own, *more])  # type: ignore[attr-defined]
        return function

    return show


def check_no_image(texture: str) -> None:
    """Raise UserError where the texture of shapes that become one another is to come from an image."""
    if texture not in ("auto", "none"):
        raise UserError(f"--texture {texture}: auto or none is needed; two shapes have no image in common")


def file_omegas(omega: Numbers | None, count: int) -> list[float | None]:
    """Read omega_0 of each of `count` checkpoints; None stands for what the files say. Raises UserError."""
    text = text_of(omega)
    if text is None:
        return [None] * count
    try:
        values: list[float | None] = [float(part) for part in text.split(",")]
    except ValueError:
        raise UserError(f"--omega {text}: numbers joined by commas are needed") from None
    if len(values) != count:
        raise UserError(f"--omega: {len(values)} of {count} numbers, one for each file")
    return values


def text_of(numbers: Numbers | None) -> str | None:
    """Write numbers as on the command line, whose parsers check them."""
    if numbers is None or isinstance(numbers, str):
        return numbers
    return ",".join(map(repr, [numbers] if isinstance(numbers, (int, float)) else map(float, numbers)))
