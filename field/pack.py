"""Packs a model: rounds its weights to few bits, measures its bands anew, and says what that costs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from ..ir.lower import lower
from ..model.errors import UserError
from ..model.model import DELTA_FACTOR, Array, Level, Model, Network
from ..model.packed_weights import pack
from ..model.surface_figures import surface_record
from . import interpret
from .compensated import Samples, output, samples_around
from .rounding import rounding_error
from .row_steps import rounded_by_rows
from .surface_points import in_last_band, newton

DISTANCE, ANGLE = 0.4, 0.3
"""Largest root mean square errors of f and of the normals, as shares of the means of |f| and of the angle that the
training measured on the shape: about 8 % and 4 % of these are added."""
LEAST_DISTANCE, LEAST_ANGLE = 5e-5, 0.4
"""Smaller errors, in model units and in degrees, are not asked for."""
USUAL_DISTANCE, USUAL_ANGLE = 0.02, 0.7
"""Errors where the training measured none: of f as a share of the last delta, and of the normals in degrees."""
COLOR = 1.5 / 255
"""Largest root mean square error of the colors."""
COARSE = 3.0
"""Factor on the errors of the weights in levels before the last, whose errors the next level mostly corrects."""
GRADIENTS, NEAR = 0.01, 0.003
"""Weight of the gradient's error relative to the distance's, and distance of a sample's neighbors, model units."""
POINTS, HELD_OUT = 12_000, 4000
"""Largest number of samples of a network, and points at which errors are measured."""
WORK = 2.5e8
"""Largest product of samples and weights of a network."""
ATTEMPTS, CLOSE = 4, 0.85
"""Attempts to reach a limit, and the share of it that is close enough."""
FINE_POINTS, FINE_SHARE, FINE_CLOSE = 3000, 0.003, 0.5
"""For a limit of the largest error: the largest number of samples, which costs half a bit and saves three quarters of
the time; the error that a weight may add, as a share of the limit; and the share of it that is close enough."""

Result = TypeVar("Result")


@dataclass(frozen=True)
class Packed:
    """A packed model, and what the rounding costs near the surface."""

    model: Model
    distance: float
    """Mean difference of f, model units."""
    angle: float
    """Mean angle between the normals, degrees."""
    color: float | None
    """Root mean square difference of the colors, in [0, 1]; None without colors."""
    bits: float
    """Bits for each weight and bias."""


def packed(model: Model, bits: float | None = None, most: float | None = None) -> Packed:
    """Round the weights of a model, so that `model_file.save` packs them.

    bits: for each weight, on average; None: the fewest that keep the errors within limits. most: limit of the largest
    error of f near the surface, model units, in place of the limits of its mean and of the normals; the search is
    coarser. Raises UserError for moving models, for scenes, and where no surface is found.
    """
    if model.scene is not None or model.inputs != "xyz":
        raise UserError("pack: scenes and moving models stay as they are; pack the models of a scene before `compose`")
    program = lower(model)
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.9, 0.9, (2 * (POINTS + HELD_OUT), 3)).astype(np.float32)
    surface = in_last_band(program, newton(program, points, 5)[0])
    surface = surface[np.linalg.norm(surface, axis=1) < 1.05]
    if len(surface) < 2 * HELD_OUT:
        raise UserError("pack: the model has no surface, or hardly any")
    surface, checks = surface[HELD_OUT:], surface[:HELD_OUT]
    if most is None:
        levels = _levels(model, surface, checks, bits)
    else:
        surface = surface[:FINE_POINTS]
        levels = _fine_levels(model, surface, most)
    texture = model.texture and _texture(model.texture, surface, checks, bits)
    rounded = _measured_anew(model, replace(model, levels=levels, texture=texture), checks)
    distance, angle, _, _ = _errors(model, rounded, checks)
    color = None
    if model.texture and texture:
        color = _rms(output(model.texture, checks) - output(texture, checks))
    figures = {"distance": float(f"{distance:.3g}"), "angle": float(f"{angle:.3g}")}
    rounded = replace(rounded, provenance=_short(model.provenance) | {"packed": figures})
    return Packed(rounded, distance, angle, color, _bits(rounded.networks()))


def _bits(networks: dict[str, Network]) -> float:
    """Return the bits for each weight and bias of rounded networks."""
    count = sum(layer.weight.size + layer.bias.size for network in networks.values() for layer in network)
    return 8 * len(pack(networks) or b"") / count


def _levels(model: Model, surface: Array, checks: Array, bits: float | None) -> tuple[Level, ...]:
    """Return the levels with rounded networks."""
    most, steepest = _limits(model)

    def excess(levels: tuple[Level, ...]) -> float:
        _, _, distance, angle = _errors(model, replace(model, levels=levels), checks)
        return max(distance / most, angle / steepest)

    def networks(levels: tuple[Level, ...]) -> dict[str, Network]:
        return {str(i): level.network for i, level in enumerate(levels)}

    return _search(
        lambda share: _rounded_levels(model, surface, share),
        excess if bits is None else lambda levels: 2 ** (bits - _bits(networks(levels))),
        most / 15,
        up=bits is None,
    )


def _fine_levels(model: Model, surface: Array, most: float) -> tuple[Level, ...]:
    """Return the levels with networks that are rounded within a limit of the largest error of f."""
    return _search(
        lambda share: _rounded_levels(model, surface, share),
        lambda levels: rounding_error(model, replace(model, levels=levels))[0] / most,
        FINE_SHARE * most,
        up=True,
        close=FINE_CLOSE,
    )


def _texture(texture: Network, surface: Array, checks: Array, bits: float | None) -> Network:
    """Return the rounded network of the colors."""
    samples = Samples(surface[: _count(texture)], output(texture, surface[: _count(texture)]))
    exact = output(texture, checks)
    return _search(
        lambda share: rounded_by_rows(texture, samples, share),
        (lambda network: _rms(output(network, checks) - exact) / COLOR)
        if bits is None
        else lambda network: 2 ** (bits - _bits({"": network})),
        COLOR / 10,
        up=bits is None,
    )


def _search(
    make: Callable[[float], Result], excess: Callable[[Result], float], share: float, up: bool, close: float = CLOSE
) -> Result:
    """Return the coarsest result within a limit, or else the nearest to it.

    make: makes a result from the error that a weight may add. excess: a value of a result, over its limit, which is
    about proportional to that error. up: whether the limit is the largest allowed value; else the smallest. close: the
    share of it that is close enough.
    """
    tried: list[tuple[bool, float, Result]] = []
    for _ in range(ATTEMPTS):
        result = make(share)
        size = excess(result)
        fits = size <= 1 if up else size >= 1
        tried.append((fits, -abs(np.log(size)), result))
        if fits and (size if up else 1 / size) > close:
            break
        share *= (0.95 if up else 1.02) / size
    return max(tried, key=lambda entry: entry[:2])[2]


def _rounded_levels(model: Model, surface: Array, share: float) -> tuple[Level, ...]:
    """Return the levels with rounded networks; each corrects the errors of the levels before it."""
    levels: list[Level] = []
    last = len(model.levels) - 1
    for i, level in enumerate(model.levels):
        exact = [other.network for other in model.levels[: i + 1]]
        points = surface[: _count(level.network)]
        reach = 0.3 * (model.levels[i - 1].delta if i else model.levels[0].delta if last else 0.15)
        samples = _samples(exact, [done.network for done in levels], points, reach, inside=i == 0 < last)
        network = rounded_by_rows(level.network, samples, share * (1 if i == last else COARSE))
        levels.append(replace(level, network=network))
    return tuple(levels)


def _count(network: Network) -> int:
    """Return the number of samples of a network."""
    return max(1000, min(POINTS, int(WORK / sum(layer.weight.size for layer in network))))


def _samples(exact: list[Network], earlier: list[Network], surface: Array, reach: float, inside: bool) -> Samples:
    """Return the target of a level's network: the sum of the exact networks minus the rounded earlier networks.

    surface: points (N, 3). reach: standard deviation of the samples from it, model units. inside: whether further
    samples fill the unit ball.
    """
    everywhere = samples_around(surface, reach, inside, NEAR)
    target = output(exact[0], everywhere)
    for sign, networks in ((1, exact[1:]), (-1, earlier)):
        for network in networks:
            target = target + np.float32(sign) * output(network, everywhere)
    return Samples(everywhere, target, 3, GRADIENTS / NEAR)


def _errors(model: Model, rounded: Model, points: Array) -> tuple[float, float, float, float]:
    """Return the differences of the last levels at points: means, then root mean squares, of f and of the angle."""
    (gradients, values), (others, other_values) = (
        interpret.field_gradient(lower(each), points, len(model.levels)) for each in (model, rounded)
    )
    lengths = np.linalg.norm(gradients, axis=1) * np.linalg.norm(others, axis=1)
    cosine = np.clip((gradients * others).sum(axis=1) / np.maximum(lengths, 1e-9), -1, 1)
    angle, distance = np.degrees(np.arccos(cosine)), np.abs(values - other_values)
    return float(distance.mean()), float(angle.mean()), _rms(distance), _rms(angle)


def _limits(model: Model) -> tuple[float, float]:
    """Return the largest root mean square errors of f, model units, and of the normals, degrees."""
    records = model.provenance.get("levels")
    record = records[-1] if isinstance(records, list) and records else None
    figures = [record.get(key) if isinstance(record, dict) else None for key in ("mean_f", "angle")]
    mean, angle = (figure if isinstance(figure, float) and figure > 0 else None for figure in figures)
    return (
        max(LEAST_DISTANCE, DISTANCE * mean) if mean else USUAL_DISTANCE * model.levels[-1].delta,
        max(LEAST_ANGLE, ANGLE * angle) if angle else USUAL_ANGLE,
    )


def _measured_anew(model: Model, rounded: Model, points: Array) -> Model:
    """Return the rounded model with deltas (Eq. 5) and slopes measured anew at points of the surface (N, 3)."""
    before, after = lower(model), lower(rounded)
    levels = []
    for i, level in enumerate(rounded.levels, start=1):
        (gradients, values), (others, other_values) = (
            interpret.field_gradient(program, points, i) for program in (before, after)
        )
        if i < len(rounded.levels):
            delta = level.delta * float(np.abs(other_values).max() / np.abs(values).max())
        else:  # f is 0 at the points, but the shape is elsewhere.
            delta = level.delta + DELTA_FACTOR * float(np.abs(other_values - values).max())
        steeper = np.linalg.norm(others, axis=1).max() / np.linalg.norm(gradients, axis=1).max()
        levels.append(replace(level, delta=delta, lipschitz=level.lipschitz * float(steeper)))
    return replace(rounded, levels=tuple(levels))


def _short(provenance: dict[str, Any]) -> dict[str, Any]:
    """Return what `mplicits info` prints of a provenance: the settings would take a tenth of a packed file."""
    kept: dict[str, Any]
    kept = {key: provenance[key] for key in ("source", "seed", "seconds", "interrupted") if key in provenance}
    records = provenance.get("levels")
    if isinstance(records, list) and all(isinstance(record, dict) for record in records):
        kept["levels"] = [
            {key: _digits(record[key]) for key in ("steps", "mean_f", "angle") if key in record} for record in records
        ]
    if record := surface_record(provenance):
        kept["surface"] = {
            name: {key: _digits(figure) for key, figure in part.items()} if isinstance(part, dict) else part
            for name, part in record.to_json().items()
        }
    return kept


def _digits(value: object) -> object:
    return float(f"{value:.3g}") if isinstance(value, float) else value


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))
