"""Rounds the weights of a model to decimals or to 16-bit floats, and measures the error of the field."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..ir.at_time import at_sampled_times
from ..ir.lower import lower, output_scale
from ..model.errors import UserError
from ..model.model import Array, Layer, Model, Network
from . import interpret
from .surface_points import near_surface


def in_decimals(model: Model, digits: int) -> Model:
    """Round the weights to decimals, exactly as `lower(model, digits)` does."""

    def rounded(network: Network) -> Network:
        layers = [Layer(_round(layer.weight, digits), _round(layer.bias, digits)) for layer in network[:-1]]
        rows = [_round(row / output_scale(row), digits) * output_scale(row) for row in network[-1].weight]
        return (*layers, Layer(np.stack(rows).astype(np.float32), _round(network[-1].bias, digits + 2)))

    return _with_networks(model, rounded)


def in_float16(model: Model) -> Model:
    """Round every weight to a 16-bit float. Raises UserError for a tensor with a weight that is too large."""
    for name, tensor in model.tensors().items():
        if np.abs(tensor).max() > np.finfo(np.float16).max:
            raise UserError(f"--precision float16: {name} has values above 65,504; use --precision float32")
    return _with_networks(
        model,
        lambda network: tuple(
            Layer(layer.weight.astype(np.float16).astype(np.float32), layer.bias.astype(np.float16).astype(np.float32))
            for layer in network
        ),
    )


def is_float16(model: Model) -> bool:
    """Whether 16-bit floats hold every weight exactly."""
    with np.errstate(over="ignore"):
        return all((tensor.astype(np.float16) == tensor).all() for tensor in model.tensors().values())


def rounding_line(kind: str, error: tuple[float, float]) -> str:
    """Say how far rounding moves the distance. kind: of the rounded weights; error: of `rounding_error`."""
    largest, mean = error
    return (
        f"{kind}: the distance near the surface is off by {largest:.1e} at most, {mean:.1e} on average "
        "(the shape has radius 1)"
    )


def decimals_line(model: Model, digits: int) -> str:
    """Say how far rounding to decimals moves the distance."""
    kind = f"weights of {digits} decimal{'s' * (digits != 1)}"
    return rounding_line(kind, rounding_error(model, in_decimals(model, digits)))


def rounding_error(model: Model, coarse: Model) -> tuple[float, float]:
    """Return the largest and the mean |f - f_coarse| of the last level near the surface of `model`, model units."""
    level = len(model.levels)
    differences = []
    for exact, rounded in zip(at_sampled_times(lower(model)), at_sampled_times(lower(coarse)), strict=True):
        points = near_surface(exact)
        differences.append(np.abs(interpret.field(exact, points, level) - interpret.field(rounded, points, level)))
    difference = np.concatenate(differences)
    return float(difference.max(initial=0)), float(difference.mean()) if len(difference) else 0.0


def _with_networks(model: Model, change: Callable[[Network], Network]) -> Model:
    if model.scene is not None:
        return replace(model, shapes=tuple(_with_networks(shape, change) for shape in model.shapes))
    levels = tuple(replace(level, network=change(level.network)) for level in model.levels)
    return replace(model, levels=levels, texture=None if model.texture is None else change(model.texture))


def _round(array: Array, digits: int) -> Array:
    return np.round(array.astype(np.float64), digits).astype(np.float32)
