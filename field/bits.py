"""Rounds the weights of a model to the fewest bits that keep its surface and its colors."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..ir.lower import lower
from ..ir.program import Program
from ..model.model import Array, Level, Model, Network
from ..model.quantize import MAX_FINE, MAX_HIDDEN, is_quantized
from . import interpret
from .compensated import Samples, Sizes, output, rounded, samples_around
from .surface_points import in_last_band, newton

if TYPE_CHECKING:
    from tqdm import tqdm

ANGLE = 0.0125
"""Allowed root mean square error of the gradient near the surface, about radians of the normal."""
SHARE = 0.5
"""Allowed root mean square error of the distance, as a share of the last level's delta, but not below LEAST."""
LEAST = 3e-4
"""Smallest limit of this error, model units: 0.1 pixels where the radius of the shape has 330."""
COARSE = (0.5, 0.25, 0.1)
"""Factors on both limits for levels before the last, whose errors the next level mostly corrects. The first one counts
that leaves the next level few enough."""
COLOR = 2.3 / 255
"""Allowed root mean square error of the colors, in [0, 1]."""
HIDDEN = (*range(7, 18), 20, 23, 27, 31, 37, 44, 53, 64, 77, 91, 107, 161, 322, 645)
"""Candidates for the largest multiple of a hidden layer's step."""
START = (322, 31, 20)
"""First candidates: in levels before the last, in the last level, in the texture."""
START_TRAINED = (31, 15, 15)
"""First candidates in networks that were quantized by the training."""
ATTEMPTS = 4
"""Largest number of candidates for a network."""
FIRST, LAST = 1023, 1023
"""Largest multiples in first and last layers; networks that were quantized by the training keep their own."""
NEAR = 0.004
"""Distance of a sample's neighbors, model units."""
GRADIENTS = 0.2
"""Weight of the gradient's error relative to the distance's."""
POINTS = 12_000
"""Random points that are moved onto the surface."""
SAMPLES, WIDE_SAMPLES = 3500, 2000
"""Samples of a level for networks up to 48 wide, and for wider networks."""


@dataclass(frozen=True)
class Cost:
    """Errors near the surface after rounding."""

    distance: float
    """Root mean square error of f of the last level, model units."""
    largest: float
    """Largest error of f, model units."""
    angle: float
    """Root mean square angle between the normals, degrees."""
    color: float
    """Root mean square error of the colors, in steps of 1/255; 0 without colors."""


def fewest_bits(model: Model) -> Model | None:
    """Return the model with weights rounded to the fewest bits that keep its surface and its colors.

    Each level also corrects the errors of the levels before it. Returns None if no candidate keeps the errors within
    the limits, or if no surface is found. On a terminal, a progress bar names the network that is being rounded.
    """
    from tqdm import tqdm

    attempts = ATTEMPTS * len(model.networks())
    with tqdm(total=attempts, bar_format="{desc}|{bar}| {percentage:3.0f}%", leave=False, disable=None) as bar:
        return _all_rounded(model, bar)


def _all_rounded(model: Model, bar: "tqdm[NoReturn]") -> Model | None:
    """See `fewest_bits`. bar: counts attempts."""
    program = lower(model)
    surface = _surface(program, POINTS, 1)
    if len(surface) < 500:
        return None
    half = len(surface) // 2
    training, held_out = surface[:half], surface[half:]
    factors = COARSE if len(model.levels) > 1 else COARSE[:1]
    found = (_rounded_levels(model, coarse, training, held_out, bar) for coarse in factors)
    levels = next((levels for levels in found if levels is not None), None)
    if levels is None:
        return None
    texture = model.texture
    if texture is not None:
        samples, checks = (Samples(points, output(texture, points)) for points in (training, held_out))
        _announce(bar, len(levels), "texture")
        texture = _fewest(texture, samples, checks, (COLOR, 0.0), _start(texture, 2), bar)
        if texture is None:
            return None
    return replace(model, levels=levels, texture=texture)


def _rounded_levels(
    model: Model, coarse: float, training: Array, held_out: Array, bar: "tqdm[NoReturn]"
) -> tuple[Level, ...] | None:
    """Round the levels. Returns None if a level does not fit.

    coarse: one of COARSE. training, held_out: points (N, 3) of the surface, to round by and to check. bar: counts
    attempts.
    """
    levels: list[Level] = []
    last = len(model.levels) - 1
    for i, level in enumerate(model.levels):
        share = 1.0 if i == last else coarse
        limits = (share * max(SHARE * level.delta, LEAST), share * ANGLE)
        earlier = [done.network for done in levels]
        count = SAMPLES if level.network[0].weight.shape[0] <= 48 else WIDE_SAMPLES
        exact = [other.network for other in model.levels[: i + 1]]
        samples = _level_samples(exact, earlier, training[:count], _reach(model, i), i == 0 and last > 0)
        checks = _level_samples(exact, earlier, held_out[:count], 0.0, False)
        _announce(bar, i, f"level {i + 1}")
        network = _fewest(level.network, samples, checks, limits, _start(level.network, int(i == last)), bar)
        if network is None:
            return None
        levels.append(replace(level, network=network))
    return tuple(levels)


def cost(model: Model, coarse: Model) -> Cost:
    """Measure the errors of a model with rounded weights, at points that the rounding did not use."""
    exact, other = lower(model), lower(coarse)
    level, points = len(model.levels), _surface(exact, 5000, 2)
    if not len(points):
        return Cost(0.0, 0.0, 0.0, 0.0)
    (gradients, values), (coarse_gradients, coarse_values) = (
        interpret.field_gradient(program, points, level) for program in (exact, other)
    )
    error = np.abs(values - coarse_values)
    lengths = np.linalg.norm(gradients, axis=1) * np.linalg.norm(coarse_gradients, axis=1)
    cosine = np.clip((gradients * coarse_gradients).sum(axis=1) / np.maximum(lengths, 1e-9), -1, 1)
    color = 0.0
    if exact.colored:
        color = 255 * _rms(interpret.color(exact, points) - interpret.color(other, points))
    return Cost(_rms(error), float(error.max()), float(np.degrees(_rms(np.arccos(cosine)))), color)


def _announce(bar: "tqdm[NoReturn]", done: int, name: str) -> None:
    """Set the bar to `done` finished networks, and name the next network."""
    bar.update(ATTEMPTS * done - bar.n)
    bar.set_description(f"rounding weights, {name}")


def _fewest(
    network: Network,
    samples: Samples,
    checks: Samples,
    limits: tuple[float, float],
    start: int,
    bar: "tqdm[NoReturn]",
) -> Network | None:
    """Return a network rounded with the smallest of HIDDEN that keeps its errors within limits, None if there is none.

    limits: of the values, and of the differences between neighbors over their distance. start: the first candidate.
    bar: advances by one per attempt. The error is about proportional to the step: each attempt predicts the next one.
    """
    trained = is_quantized(network)
    first, last = (MAX_FINE, MAX_FINE) if trained else (FIRST, LAST)
    best, failed, tried = None, -1, HIDDEN.index(start)
    for _ in range(ATTEMPTS):
        attempt = rounded(network, samples, Sizes(first, HIDDEN[tried], last))
        bar.update()
        excess = _excess(attempt, checks, limits)
        wanted = HIDDEN[tried] * excess
        if excess <= 1:
            best, tried_best = attempt, tried
            following = next(k for k, size in enumerate(HIDDEN) if size >= wanted)
        else:
            failed = tried
            following = next((k for k, size in enumerate(HIDDEN) if size >= wanted), len(HIDDEN) - 1)
        if trained and max(HIDDEN[tried], HIDDEN[following]) >= MAX_HIDDEN:
            return network if best is None else best
        following = max(following, failed + 1)
        if following >= (len(HIDDEN) if best is None else tried_best):
            break
        tried = following
    return best


def _start(network: Network, kind: int) -> int:
    return (START_TRAINED if is_quantized(network) else START)[kind]


def _excess(network: Network, checks: Samples, limits: tuple[float, float]) -> float:
    """Return the larger of the errors of values and of differences between neighbors, as shares of their limits."""
    error = output(network, checks.points) - checks.target
    rows = replace(checks, weight=1 / NEAR).rows(error)
    points = len(rows) // (1 + checks.neighbors)
    excess = _rms(rows[:points]) / limits[0]
    if checks.neighbors:
        excess = max(excess, float(np.sqrt(checks.neighbors)) * _rms(rows[points:]) / limits[1])
    return excess


def _level_samples(exact: list[Network], earlier: list[Network], surface: Array, reach: float, inside: bool) -> Samples:
    """Return the target of a level's network: the sum of the exact networks minus the rounded earlier networks.

    surface: points (N, 3). reach: standard deviation of the samples from the surface, model units. inside: whether
    further samples fill the unit ball.
    """
    everywhere = samples_around(surface, reach, inside, NEAR)
    target = sum(output(network, everywhere) for network in exact) - sum(
        (output(network, everywhere) for network in earlier), np.float32(0)
    )
    return Samples(everywhere, np.asarray(target, np.float32), 3, GRADIENTS / NEAR)


def _reach(model: Model, i: int) -> float:
    """Return the distance from the surface within which level i, from 0, must be exact, as a standard deviation."""
    deltas = [level.delta for level in model.levels]
    return 0.3 * (deltas[i - 1] if i else deltas[0] if len(deltas) > 1 else 0.15)


def _surface(program: Program, count: int, seed: int) -> Array:
    """Return points (N, 3) float32 on the surface, from `count` random points in a cube."""
    points = np.random.default_rng(seed).uniform(-0.9, 0.9, (count, 3)).astype(np.float32)
    points = in_last_band(program, newton(program, points, 5)[0])
    return np.asarray(points[np.linalg.norm(points, axis=1) < 1.05])


def _rms(values: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))
