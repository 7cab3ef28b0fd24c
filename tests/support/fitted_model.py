"""A small textured model of a bumpy ball without training: random sines, last layers by least squares."""

import numpy as np
from numpy.typing import NDArray

from mplicits.model.model import Layer, Level, Model, Network

Array = NDArray[np.float64]


def radius(direction: Array) -> Array:
    """Compute the radius of the ball in unit directions (N, 3). Returns (N,)."""
    x, y, z = direction.T
    return np.asarray(0.75 + 0.08 * np.sin(5 * x) * np.sin(5 * y) * np.sin(5 * z), float)


def distance(points: Array) -> Array:
    """Compute the signed distance from points (N, 3) to the ball along the ray from its center. Returns (N,).

    Near the surface it is exact to second order.
    """
    length = np.linalg.norm(points, axis=1)
    return np.asarray(length - radius(points / length[:, None]), float)


def fitted_model(widths: tuple[int, int] = (24, 96)) -> Model:
    """Fit two levels of these widths without hidden N -> N layers, with the deltas of Eq. 5, and a 16x0 texture.

    Its step bounds differ, so that a target that mixes them up makes other steps.
    """
    rng = np.random.default_rng(5)
    points = rng.normal(size=(6000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    surface = points * radius(points)[:, None]
    points *= rng.uniform(0.05, 1.05, 6000)[:, None]
    first = fit(widths[0], 1.5, points, distance(points)[:, None], rng)
    near = surface * rng.uniform(0.75, 1.25, (6000, 1))
    second = fit(widths[1], 4.0, near, distance(near)[:, None] - evaluate(first, near), rng)
    texture = fit(16, 3.0, surface, 0.5 + 0.4 * np.sin(surface * (3.0, 4.0, 5.0)), rng)
    return Model("fitted", levels_of(first, second, surface), texture)


def levels_of(first: Network, second: Network, surface: Array) -> tuple[Level, Level]:
    """Return two levels of these networks, with the deltas of Eq. 5 on points of the surface (N, inputs)."""
    errors = evaluate(first, surface), evaluate(first, surface) + evaluate(second, surface)
    deltas = [1.3 * float(np.abs(error).max()) for error in errors]
    return (
        Level(first, deltas[0], 20, step_bound=0.78, band_step_bound=0.7),
        Level(second, deltas[1], 5, step_bound=0.75),
    )


def fit(width: int, omega: float, points: Array, truth: Array, rng: np.random.Generator) -> Network:
    """Fit a network to truth: (N, outputs) at points (N, 3), or (N, 4) with a time.

    Its only hidden layer is of random sines; its last layer solves the normal equations.
    """
    weight, bias = rng.normal(0, omega, (width, points.shape[1])), rng.uniform(-np.pi, np.pi, width)
    features = np.concatenate([np.sin(points @ weight.T + bias), np.ones((len(points), 1))], axis=1)
    solution = np.linalg.solve(features.T @ features + 1e-4 * np.eye(width + 1), features.T @ truth)
    hidden = Layer(weight.astype(np.float32), bias.astype(np.float32))
    return hidden, Layer(solution[:-1].T.astype(np.float32), solution[-1].astype(np.float32))


def evaluate(network: Network, points: Array) -> Array:
    """Evaluate a network of one hidden layer at points (N, inputs). Returns (N, outputs)."""
    hidden, last = network
    return np.asarray(np.sin(points @ hidden.weight.T + hidden.bias) @ last.weight.T + last.bias, float)
