"""The fewest bits that the weights of a model need as text, found by rounding them and measuring what it costs."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..ir.lower import lower
from ..ir.program import Program
from ..model.model import Array, Level, Model, Network
from ..model.quantise import MAX_FINE, MAX_HIDDEN, is_quantised
from . import interpret
from .compensated import Samples, Sizes, output, rounded

if TYPE_CHECKING:
    from tqdm import tqdm

ANGLE = 0.0125
"""Root mean square error of the gradient near the surface that rounding may make; times 57.3, degrees of normals."""
SHARE = 0.5
"""The same of the distance, as a share of the last level's delta."""
COARSE = 0.5
"""Share of these limits that a level before the last one may take: the next level makes up for the most of it."""
COLOUR = 2.3 / 255
"""Root mean square error of colours that rounding may make, of 1."""
HIDDEN = (*range(7, 18), 20, 23, 27, 31, 37, 44, 53, 64, 77, 91, 107, 161, 322, 645)
"""Largest multiples that are tried in hidden layers."""
START = (322, 31, 20)
"""Largest multiples that are tried first: in levels before the last one, in the last one, in the texture."""
START_TRAINED = (31, 15, 15)
"""The same in networks that training quantised."""
ATTEMPTS = 4
"""How often a network is rounded at most."""
FIRST, LAST = 1023, 1023
"""Largest multiples in first and last layers, but for networks that training quantised, which keep theirs."""
NEAR = 0.004
"""Distance of a sample's neighbours, model units."""
GRADIENTS = 0.2
"""Weight of the gradient's error against that of the distance."""
POINTS = 12_000
"""Random points from which the samples on the surface come."""
SAMPLES, WIDE_SAMPLES = 3500, 2000
"""Samples of a level: of networks up to 48 wide, and wider."""


@dataclass(frozen=True)
class Cost:
    """What rounding the weights of a model costs near its surface."""

    distance: float
    """Root mean square error of f of the last level, model units."""
    largest: float
    """The largest error of it."""
    angle: float
    """Root mean square angle between the normals, degrees."""
    colour: float
    """Root mean square error of the colours, in steps of 1/255; 0 where there are none."""


def fewest_bits(model: Model) -> Model | None:
    """Return the model with weights rounded to the fewest bits that keep its surface and its colours.

    The levels are rounded one after the other, each so that it makes up for the error of those before. Returns None
    where no number of bits that is tried is enough, or where no surface is found. On a terminal, a progress bar shows
    which network is being rounded.
    """
    from tqdm import tqdm

    attempts = ATTEMPTS * len(model.networks())
    with tqdm(total=attempts, bar_format="{desc}|{bar}| {percentage:3.0f}%", leave=False, disable=None) as bar:
        return _all_rounded(model, bar)


def _all_rounded(model: Model, bar: "tqdm[NoReturn]") -> Model | None:
    """Do the work of `fewest_bits`. bar: counts attempts."""
    program = lower(model)
    surface = _surface(program, POINTS, 1)
    if len(surface) < 500:
        return None
    half = len(surface) // 2
    training, held_out = surface[:half], surface[half:]
    levels: list[Level] = []
    last = len(model.levels) - 1
    for i, level in enumerate(model.levels):
        share = 1.0 if i == last else COARSE
        limits = (share * SHARE * model.levels[last].delta, share * ANGLE)
        if i < last:
            limits = (share * SHARE * level.delta, limits[1])
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
    texture = model.texture
    if texture is not None:
        samples, checks = (Samples(points, output(texture, points)) for points in (training, held_out))
        _announce(bar, len(levels), "texture")
        texture = _fewest(texture, samples, checks, (COLOUR, 0.0), _start(texture, 2), bar)
        if texture is None:
            return None
    return replace(model, levels=tuple(levels), texture=texture)


def cost(model: Model, coarse: Model) -> Cost:
    """Measure what a model with rounded weights costs, on points that the rounding did not see."""
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
    colour = 0.0
    if exact.coloured:
        colour = 255 * _rms(interpret.colour(exact, points) - interpret.colour(other, points))
    return Cost(_rms(error), float(error.max()), float(np.degrees(_rms(np.arccos(cosine)))), colour)


def _announce(bar: "tqdm[NoReturn]", done: int, name: str) -> None:
    """Show that so many networks are done, which may have taken fewer attempts than they had, and which one is next."""
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
    """Return a network rounded so that its errors stay within limits; None where none of HIDDEN does.

    limits: of the values, and of the differences between neighbours by their distance. start: the largest multiple that
    is tried first. bar: moves by one at each attempt. The error goes roughly with the step, so that each attempt says
    which one is worth the next.
    """
    trained = is_quantised(network)
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
    return (START_TRAINED if is_quantised(network) else START)[kind]


def _excess(network: Network, checks: Samples, limits: tuple[float, float]) -> float:
    """Return the larger of the errors of values and of differences between neighbours, as shares of their limits."""
    error = output(network, checks.points) - checks.target
    rows = replace(checks, weight=1 / NEAR).rows(error)
    points = len(rows) // (1 + checks.neighbours)
    excess = _rms(rows[:points]) / limits[0]
    if checks.neighbours:
        excess = max(excess, float(np.sqrt(checks.neighbours)) * _rms(rows[points:]) / limits[1])
    return excess


def _level_samples(exact: list[Network], earlier: list[Network], surface: Array, reach: float, inside: bool) -> Samples:
    """Return what a level's network is to keep: the sum of the exact networks, less that of the rounded earlier ones.

    surface: points (N, 3). reach: how far from them the samples are, at most some three times that, model units.
    inside: whether there are samples in all of the unit ball as well.
    """
    rng = np.random.default_rng(3)
    points = surface + rng.normal(scale=reach, size=surface.shape) if reach else surface.astype(np.float64)
    if inside:
        directions = rng.normal(size=(len(points) // 3, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points = np.concatenate([points, directions * rng.uniform(size=(len(directions), 1)) ** (1 / 3)])
    steps = np.concatenate([np.zeros((1, 3)), NEAR * np.eye(3)])
    everywhere = (points[None] + steps[:, None]).reshape(-1, 3).astype(np.float32)
    target = sum(output(network, everywhere) for network in exact) - sum(
        (output(network, everywhere) for network in earlier), np.float32(0)
    )
    return Samples(everywhere, np.asarray(target, np.float32), 3, GRADIENTS / NEAR)


def _reach(model: Model, i: int) -> float:
    """Return how far from the surface level i, counted from 0, has to be right, as a standard deviation."""
    deltas = [level.delta for level in model.levels]
    return 0.3 * (deltas[i - 1] if i else deltas[0] if len(deltas) > 1 else 0.15)


def _surface(program: Program, count: int, seed: int) -> Array:
    """Return points (N, 3) float32 on the surface: random ones in a ball, moved there by Newton's method."""
    level = len(program.bands)
    points = np.random.default_rng(seed).uniform(-0.9, 0.9, (count, 3)).astype(np.float32)
    for _ in range(5):
        gradient, value = interpret.field_gradient(program, points, level)
        points -= (value / np.maximum(np.square(gradient).sum(axis=1), 0.25))[:, None] * gradient
    arrived = np.abs(interpret.field(program, points, level)) < program.bands[-1].delta
    inside: Array = points[arrived & (np.linalg.norm(points, axis=1) < 1.05)]
    return inside


def _rms(values: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))
