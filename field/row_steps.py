"""Rounds a network's weights to multiples of a step for each row, for packed files (model/packed_weights.py).

A row's step is inverse to the row's effect on the output, so that all weights share the error: with entropy coding this
needs the fewest bits (reverse water-filling). Later weights compensate the errors of earlier ones, as in
compensated.py, whose samples are used here.
"""

import numpy as np
from numpy.typing import NDArray

from ..model.model import Array, Layer, Network
from ..model.packed_weights import BIAS, step
from .compensated import DAMPING, Double, Samples

NEURONS, AGAIN = 4, 4
"""Number of neurons whose weights are rounded together, and of such groups between two evaluations of the output."""


def rounded_by_rows(network: Network, samples: Samples, share: float) -> Network:
    """Return the network with weights that `packed_weights.pack` takes.

    share: the root of the mean square error that a weight may add to the output, for all weights the same.
    """
    layers = [Layer(layer.weight.copy(), layer.bias.copy()) for layer in network]
    source = samples.points
    for j, layer in enumerate(layers):
        _round(layers, j, source, samples, share)
        source = np.sin(source @ layer.weight.T + layer.bias)
    return tuple(layers)


def _round(layers: list[Layer], j: int, source: Array, samples: Samples, share: float) -> None:
    """Round layer `j` in place. source: its input at the samples' points, (N, in)."""
    layer, together = layers[j], 1 if j == len(layers) - 1 else NEURONS
    inputs = np.concatenate([source, np.ones((len(source), 1), np.float32)], axis=1)
    error, slopes = _error_and_slopes(layers, j, source, samples)
    exponents = [_exponent(_jacobian(slopes, [row], inputs, samples), share) for row in range(len(layer.weight))]
    for k in range(0, len(exponents), together):
        if k and k % (AGAIN * together) == 0:
            error, slopes = _error_and_slopes(layers, j, source, samples)
        rows = list(range(k, min(len(exponents), k + together)))
        jacobian = _jacobian(slopes, rows, inputs, samples)
        weights = np.concatenate([layer.weight[rows], layer.bias[rows, None]], axis=1).astype(np.float64)
        steps = np.repeat([[step(exponents[row])] for row in rows], weights.shape[1], axis=1)
        steps[:, -1] /= BIAS
        new = _rounded(weights.ravel(), steps.ravel(), jacobian, error).reshape(weights.shape)
        error = error + jacobian @ (new - weights).ravel().astype(np.float32)
        layer.weight[rows], layer.bias[rows] = new[:, :-1], new[:, -1]


def _error_and_slopes(layers: list[Layer], j: int, source: Array, samples: Samples) -> tuple[Array, list[Array]]:
    """Return the error of the samples' rows, all outputs in one, and the outputs' derivatives by layer j's angles."""
    angles = [source @ layers[j].weight.T + layers[j].bias]
    for layer in layers[j + 1 :]:
        angles.append(np.sin(angles[-1]) @ layer.weight.T + layer.bias)
    slopes = []
    for c in range(angles[-1].shape[1]):
        slope = np.zeros_like(angles[-1])
        slope[:, c] = 1
        for layer, before in zip(layers[:j:-1], angles[-2::-1], strict=True):
            slope = (slope @ layer.weight) * np.cos(before)
        slopes.append(slope)
    error = angles[-1] - samples.target
    return np.concatenate([samples.rows(error[:, c]) for c in range(error.shape[1])]), slopes


def _jacobian(slopes: list[Array], rows: list[int], inputs: Array, samples: Samples) -> Array:
    """Return the derivatives of the samples' rows by the weights and biases of a layer's rows."""
    products = [(slope[:, rows, None] * inputs[:, None, :]).reshape(len(inputs), -1) for slope in slopes]
    return np.concatenate([samples.rows(product) for product in products])


def _hessian(jacobian: Array) -> Double:
    """Return the damped matrix of the squared error's second derivatives."""
    matrix = (jacobian.T @ jacobian).astype(np.float64)
    matrix[np.diag_indices_from(matrix)] += DAMPING * np.trace(matrix) / len(matrix) + 1e-12
    return matrix


def _exponent(jacobian: Array, share: float) -> int:
    """Return the exponent of a row's step, with which its weights each add an error of `share`."""
    points = len(jacobian)
    diagonal = np.diag(np.linalg.cholesky(np.linalg.inv(_hessian(jacobian))))[:-1]
    size = share * np.sqrt(points) * np.exp(np.log(diagonal).mean())
    return int(np.clip(np.rint(2 * np.log2(size)), -60, 60))


def _rounded(weights: Double, steps: Double, jacobian: Array, error: Array) -> NDArray[np.float64]:
    """Return weights (n,) as multiples of their steps, near the minimum of the squared error."""
    matrix = _hessian(jacobian)
    best = weights - np.linalg.solve(matrix, (jacobian.T @ error).astype(np.float64))
    factor = np.linalg.cholesky(np.linalg.inv(matrix)).T
    result = np.empty_like(best)
    for i in range(len(best)):
        result[i] = np.rint(best[i] / steps[i]) * steps[i]
        best[i:] -= (best[i] - result[i]) / factor[i, i] * factor[i, i:]
    return result + 0.0  # A file has no -0.
