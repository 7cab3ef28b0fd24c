"""The step of Muon, from its papers: singular values instead of matrix products, in 64 bits."""

import numpy as np

MOMENTUM, COEFFICIENTS, ITERATIONS = 0.95, (3.4445, -4.775, 2.0315), 5


def nearly_orthogonal(matrix: np.ndarray) -> np.ndarray:
    """Apply the polynomial of Jordan et al. (2024) to the singular values of a matrix of norm 1."""
    left, values, right = np.linalg.svd(matrix.astype(np.float64))
    values /= max(np.linalg.norm(values), 1e-20)
    first, third, fifth = COEFFICIENTS
    for _ in range(ITERATIONS):
        values = first * values + third * values**3 + fifth * values**5
    return np.asarray((left * values) @ right)


class Muon:
    """Muon with Nesterov's momentum on one square matrix, with the scale of Liu et al. (2025)."""

    def __init__(self, weight: np.ndarray, rate: float) -> None:
        self.weight, self._rate = weight.astype(np.float64), 0.2 * len(weight) ** 0.5 * rate
        self._mean = np.zeros_like(self.weight)

    def step(self, gradient: np.ndarray, factor: float) -> None:
        """Take one step with `factor` times the rate."""
        self._mean = MOMENTUM * self._mean + (1 - MOMENTUM) * gradient
        update = (1 - MOMENTUM) * gradient + MOMENTUM * self._mean
        self.weight -= factor * self._rate * nearly_orthogonal(update)
