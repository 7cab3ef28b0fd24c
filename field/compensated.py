"""Rounding the weights of a trained network to few bits, so that each weight makes up for the rounding of those before.

The weights of a few neurons are rounded at a time, one after the other. Each rounding moves the weights of these
neurons that are still free to where they undo most of its effect on the network's output: with the matrix H of the
squared error's second derivatives, as in Optimal Brain Surgeon (Hassibi and Stork 1993) and GPTQ (Frantar et al. 2022).
Then the output is computed anew, so that the next neurons begin by making up for what is left. docs/lessons.md says
how much this gains.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..model.model import Array, Layer, Network
from ..model.quantise import are_multiples, step_of

NEURONS = 4
"""Neurons whose weights are rounded with one H."""
DAMPING = 3e-4
"""Added to the diagonal of H, as a share of its mean: it keeps weights near where they were."""
CLIP = 4.0
"""Largest weight that a hidden layer keeps, in standard deviations of its weights, where multiples are few."""
FEW = 44
"""Largest multiple up to which larger weights are clipped: a smaller step is worth more to all the others then."""
FREE = 10**9
"""Largest multiple where any will do."""

Double = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Samples:
    """What a network is to keep: its output at points, and how the output differs between neighbours."""

    points: Array
    """(N (1 + neighbours), 3) float32: N points, then the first neighbour of each, and so on."""
    target: Array
    """(N (1 + neighbours), outputs) float32, the output that it should have there."""
    neighbours: int = 0
    """How many neighbours each point has."""
    weight: float = 0.0
    """Factor on differences between a point and its neighbour, compared with the value at the point."""

    def rows(self, values: Array) -> Array:
        """Turn values (N (1 + neighbours), ...) into values at points and weighted differences, of the same shape."""
        points = len(values) // (1 + self.neighbours)
        here = values[:points]
        others = [values[k * points : (k + 1) * points] - here for k in range(1, 1 + self.neighbours)]
        return np.concatenate([here, *(np.float32(self.weight) * other for other in others)])


@dataclass(frozen=True)
class Sizes:
    """The largest multiples of their steps that weights may be."""

    first: int
    """In the first layer; its bias has a step of its own."""
    hidden: int
    """In the matrices of hidden layers. Their biases have the same step, and two digits."""
    last: int
    """In each row of the last layer, which has a step for each row."""


def rounded(network: Network, samples: Samples, sizes: Sizes) -> Network:
    """Return the network with weights rounded to multiples of steps. Layers that are so already are kept."""
    layers = [Layer(layer.weight.copy(), layer.bias.copy()) for layer in network]
    kept = True
    source = samples.points
    for j, layer in enumerate(network):
        kept = kept and _is_rounded(layer, j, len(network), sizes)
        if not kept:
            _round_layer(layers, j, source, samples, sizes)
        source = np.sin(source @ layers[j].weight.T + layers[j].bias)
    return tuple(layers)


def output(network: Network, points: Array) -> Array:
    """Evaluate a network at points (N, 3) float32. Returns (N, outputs) float32."""
    for layer in network[:-1]:
        points = np.sin(points @ layer.weight.T + layer.bias)
    values: Array = points @ network[-1].weight.T + network[-1].bias
    return values


def _is_rounded(layer: Layer, j: int, layers: int, sizes: Sizes) -> bool:
    """Whether a layer needs no rounding: all its weights are multiples already, and no larger ones than allowed."""
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
    """Compute the output of a network from the angles of layer `j`, (N, width), and its derivatives by some of them.

    Returns the output (N, outputs), and for each output the derivatives (N, neurons).
    """
    later = [angles]
    for layer in layers[j + 1 :]:
        later.append(np.sin(later[-1]) @ layer.weight.T + layer.bias)
    slopes = []
    for c in range(later[-1].shape[1]):
        slope = np.zeros_like(later[-1])
        slope[:, c] = 1
        for layer, (before, _) in zip(layers[:j:-1], list(pairwise(later))[::-1], strict=True):
            slope = (slope @ layer.weight) * np.cos(before)
        slopes.append(slope[:, neurons])
    return later[-1], slopes


def _steps(layer: Layer, j: int, last: bool, sizes: Sizes) -> tuple[Double, Double]:
    """Return the step of each weight of a layer and its largest multiple, (rows, columns + 1), the bias as a column."""
    rows, columns = layer.weight.shape
    top = np.abs(layer.weight).max()
    if last:
        weight = np.abs(layer.weight).max(axis=1, keepdims=True) / sizes.last
        bias, most, bias_most = np.full(1, 1e-5), sizes.last, FREE
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
    """Round steps to three digits, which makes their text short; a step of 0 becomes 1."""
    rounded_steps: Double = np.vectorize(lambda step: float(f"{step:.3g}") or 1.0, otypes=[float])(steps)
    return rounded_steps


def _round_weights(weights: Double, hessian: Array, gradient: Array, steps: Double, largest: Double) -> Double:
    """Return weights (n,) as multiples of their steps, near the least of a squared error.

    hessian, gradient: of half the squared error at `weights`, (n, n) and (n,). largest: multiples allowed, (n,).
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
