"""Rounds the weights of a trained network to few bits; later weights compensate the errors of earlier ones.

The weights of a few neurons are rounded one after the other. After each, the remaining weights of these neurons move
to where they undo most of its effect on the network's output, by the matrix H of the squared error's second
derivatives, as in Optimal Brain Surgeon (Hassibi and Stork 1993) and GPTQ (Frantar et al. 2022). The output is then
evaluated again, and the next neurons start by compensating its error.
docs/lessons.md says how much this gains.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..model.model import Array, Layer, Network
from ..model.quantize import are_multiples, step_of

NEURONS = 4
"""Number of neurons whose weights share one H."""
DAMPING = 3e-4
"""Addend to the diagonal of H, as a share of its mean; keeps weights near their values."""
CLIP = 4.0
"""Limit of the weights of a hidden layer, in their standard deviations, if the largest multiple is at most FEW."""
FEW = 44
"""For so few multiples, a smaller step for all weights is worth the clipping of the largest weights."""
UNLIMITED = 10**9
"""Largest multiple without a limit."""

Double = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Samples:
    """The target of a network: its output at points, and the differences of its output between neighbors."""

    points: Array
    """(N (1 + neighbors), 3) float32: N points, then the first neighbor of each, and so on."""
    target: Array
    """(N (1 + neighbors), outputs) float32."""
    neighbors: int = 0
    """Number of neighbors of each point."""
    weight: float = 0.0
    """Factor on the differences, relative to the values."""

    def rows(self, values: Array) -> Array:
        """Turn values (N (1 + neighbors), ...) into values at points and weighted differences, of the same shape."""
        points = len(values) // (1 + self.neighbors)
        here = values[:points]
        others = [values[k * points : (k + 1) * points] - here for k in range(1, 1 + self.neighbors)]
        return np.concatenate([here, *(np.float32(self.weight) * other for other in others)])


@dataclass(frozen=True)
class Sizes:
    """The largest multiples of the steps."""

    first: int
    """In the first layer; the bias has a separate step."""
    hidden: int
    """In the matrices of hidden layers. Biases have the same step, and two digits."""
    last: int
    """In each row of the last layer; each row has a separate step."""


def rounded(network: Network, samples: Samples, sizes: Sizes) -> Network:
    """Return the network with weights rounded to multiples of steps. Leading layers that fit already stay unchanged."""
    layers = [Layer(layer.weight.copy(), layer.bias.copy()) for layer in network]
    kept = True
    source = samples.points
    for j, layer in enumerate(network):
        kept = kept and _is_rounded(layer, j, len(network), sizes)
        if not kept:
            _round_layer(layers, j, source, samples, sizes)
        source = np.sin(source @ layers[j].weight.T + layers[j].bias)
    return tuple(layers)


def samples_around(surface: Array, reach: float, inside: bool, near: float) -> Array:
    """Draw points around a surface, and add three copies of them, moved along x, y and z.

    surface: points (N, 3). reach: standard deviation of the points from the surface, model units. inside: whether
    further points fill the unit ball. near: how far the copies move. Returns (4 M, 3) float32: the points, then the
    copies.
    """
    rng = np.random.default_rng(3)
    points = surface + rng.normal(scale=reach, size=surface.shape) if reach else surface.astype(np.float64)
    if inside:
        directions = rng.normal(size=(len(points) // 3, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points = np.concatenate([points, directions * rng.uniform(size=(len(directions), 1)) ** (1 / 3)])
    steps = np.concatenate([np.zeros((1, 3)), near * np.eye(3)])
    everywhere: Array = (points[None] + steps[:, None]).reshape(-1, 3).astype(np.float32)
    return everywhere


def output(network: Network, points: Array) -> Array:
    """Evaluate a network at points (N, 3) float32. Returns (N, outputs) float32."""
    for layer in network[:-1]:
        points = np.sin(points @ layer.weight.T + layer.bias)
    values: Array = points @ network[-1].weight.T + network[-1].bias
    return values


def _is_rounded(layer: Layer, j: int, layers: int, sizes: Sizes) -> bool:
    """Whether all weights of a layer are allowed multiples of a step."""
    if j == 0:
        return all(step_of(array, sizes.first) is not None for array in (layer.weight, layer.bias))
    if j == layers - 1:
        return all(step_of(row, sizes.last) is not None for row in layer.weight)
    step = step_of(layer.weight, sizes.hidden)
    return step is not None and are_multiples(layer.bias, step)


def _round_layer(layers: list[Layer], j: int, source: Array, samples: Samples, sizes: Sizes) -> None:
    """Round layer `j` of a network in place. source: the layer's input at the samples' points, (N, in)."""
    layer, last = layers[j], j == len(layers) - 1
    inputs = np.concatenate([source, np.ones((len(source), 1), np.float32)], axis=1)
    steps, largest = _steps(layer, j, last, sizes)
    angles = source @ layer.weight.T + layer.bias
    rows = len(layer.weight)
    for k in range(0, rows, 1 if last else NEURONS):
        neurons = np.arange(k, min(rows, k + (1 if last else NEURONS)))
        values, slopes = _forward_and_back(layers, j, angles, neurons)
        error = np.concatenate([samples.rows((values - samples.target)[:, c]) for c in range(values.shape[1])])
        jacobian = np.concatenate(
            [samples.rows((slope[:, :, None] * inputs[:, None, :]).reshape(len(inputs), -1)) for slope in slopes]
        )
        weights = np.concatenate([layer.weight[neurons], layer.bias[neurons, None]], axis=1).astype(np.float64)
        new = _round_weights(
            weights.ravel(), jacobian.T @ jacobian, jacobian.T @ error, steps[neurons].ravel(), largest[neurons].ravel()
        ).reshape(weights.shape)
        layer.weight[neurons], layer.bias[neurons] = new[:, :-1], new[:, -1]
        angles[:, neurons] = source @ layer.weight[neurons].T + layer.bias[neurons]


def _forward_and_back(
    layers: list[Layer], j: int, angles: Array, neurons: NDArray[np.int64]
) -> tuple[Array, list[Array]]:
    """Return a network's output (N, outputs) from the angles of layer `j`, (N, width), and its derivatives.

    The derivatives are by the angles of `neurons`: (N, neurons) for each output.
    """
    later = [angles]
    for layer in layers[j + 1 :]:
        later.append(np.sin(later[-1]) @ layer.weight.T + layer.bias)
    slopes = []
    for c in range(later[-1].shape[1]):
        slope = np.zeros_like(later[-1])
        slope[:, c] = 1
        for layer, (inputs, _) in zip(layers[:j:-1], list(pairwise(later))[::-1], strict=True):
            slope = (slope @ layer.weight) * np.cos(inputs)
        slopes.append(slope[:, neurons])
    return later[-1], slopes


def _steps(layer: Layer, j: int, last: bool, sizes: Sizes) -> tuple[Double, Double]:
    """Return the step of each weight of a layer and its largest multiple, (rows, columns + 1), bias last."""
    rows, columns = layer.weight.shape
    top = np.abs(layer.weight).max()
    if last:
        weight = np.abs(layer.weight).max(axis=1, keepdims=True) / sizes.last
        bias, most, bias_most = np.full(1, 1e-5), sizes.last, UNLIMITED
    elif j == 0:
        weight, bias = np.full((1, 1), top / sizes.first), np.full(1, np.abs(layer.bias).max() / sizes.first)
        most = bias_most = sizes.first
    else:
        few = sizes.hidden <= FEW
        weight = np.full((1, 1), (min(CLIP * float(layer.weight.std()), top) if few else top) / sizes.hidden)
        bias, most, bias_most = weight[0], sizes.hidden, 2 * sizes.hidden * (sizes.hidden + 1)
    steps = np.empty((rows, columns + 1))
    steps[:, :-1], steps[:, -1] = _three_digits(weight), _three_digits(bias)
    largest = np.full(steps.shape, float(most))
    largest[:, -1] = bias_most
    return steps, largest


def _three_digits(steps: Double) -> Double:
    """Round steps to three digits for a short text; a step of 0 becomes 1."""
    rounded_steps: Double = np.vectorize(lambda step: float(f"{step:.3g}") or 1.0, otypes=[float])(steps)
    return rounded_steps


def _round_weights(weights: Double, hessian: Array, gradient: Array, steps: Double, largest: Double) -> Double:
    """Return weights (n,) as multiples of their steps, near the minimum of a squared error.

    hessian, gradient: of half the squared error at `weights`, (n, n) and (n,). largest: allowed multiples (n,).
    """
    matrix = hessian.astype(np.float64)
    matrix[np.diag_indices_from(matrix)] += DAMPING * np.trace(matrix) / len(matrix) + 1e-12
    best = weights - np.linalg.solve(matrix, gradient.astype(np.float64))
    factor = np.linalg.cholesky(np.linalg.inv(matrix)).T
    result = np.empty_like(best)
    for i in range(len(best)):
        result[i] = np.clip(np.rint(best[i] / steps[i]), -largest[i], largest[i]) * steps[i]
        best[i:] -= (best[i] - result[i]) / factor[i, i] * factor[i, i:]
    return result
