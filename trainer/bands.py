"""The half widths delta_i of the nested bands |f_i| < delta_i."""

from torch import Tensor

EPSILON = 0.3
"""Share by which a band is wider than the surface needs."""


def delta(f: Tensor) -> float:
    """Compute delta_i by Eq. 5, (1 + epsilon) max_j |f_i(x_j)|, from the values of f_i at points x_j of the surface."""
    return (1 + EPSILON) * max(float(f.abs().max()), 1e-6)
