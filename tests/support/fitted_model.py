"""A small model of a bumpy, coloured ball without training: random sines, last layers by least squares."""

import numpy as np
from mplicits.model.model import Layer, Level, Model, Network
from numpy.typing import NDArray

Array = NDArray[np.float64]


def radius(direction: Array) -> Array:
    """(N,) radius of the ball in each direction (N, 3)."""
    x, y, z = direction.T
    return np.asarray(0.75 + 0.08 * np.sin(5 * x) * np.sin(5 * y) * np.sin(5 * z), float)


def distance(points: Array) -> Array:
    """(N,) distance to the ball along the ray from its centre: signed, exact to second order near the surface."""
    length = np.linalg.norm(points, axis=1)
    return np.asarray(length - radius(points / length[:, None]), float)


def fitted_model(widths: tuple[int, int] = (24, 96)) -> Model:
    """Levels 24x0 and 96x0, and a texture of 16x0; the deltas of Eq. 5."""
    rng = np.random.default_rng(5)
    points = rng.normal(size=(6000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    surface = points * radius(points)[:, None]
    points *= rng.uniform(0.05, 1.05, 6000)[:, None]
    first = _fit(widths[0], 1.5, points, distance(points)[:, None], rng)
    near = surface * rng.uniform(0.75, 1.25, (6000, 1))
    second = _fit(widths[1], 4.0, near, distance(near)[:, None] - _run(first, near), rng)
    texture = _fit(16, 3.0, surface, 0.5 + 0.4 * np.sin(surface * (3.0, 4.0, 5.0)), rng)
    errors = _run(first, surface), _run(first, surface) + _run(second, surface)
    deltas = [1.3 * float(np.abs(error).max()) for error in errors]
    return Model("fitted", (Level(first, deltas[0], 20), Level(second, deltas[1], 5)), texture)


def _fit(width: int, omega: float, points: Array, wanted: Array, rng: np.random.Generator) -> Network:
    """One hidden layer of random sines; the last layer solves the normal equations."""
    weight, bias = rng.normal(0, omega, (width, 3)), rng.uniform(-np.pi, np.pi, width)
    features = np.concatenate([np.sin(points @ weight.T + bias), np.ones((len(points), 1))], axis=1)
    solution = np.linalg.solve(features.T @ features + 1e-4 * np.eye(width + 1), features.T @ wanted)
    hidden = Layer(weight.astype(np.float32), bias.astype(np.float32))
    return hidden, Layer(solution[:-1].T.astype(np.float32), solution[-1].astype(np.float32))


def _run(network: Network, points: Array) -> Array:
    hidden, last = network
    return np.asarray(np.sin(points @ hidden.weight.T + hidden.bias) @ last.weight.T + last.bias, float)
