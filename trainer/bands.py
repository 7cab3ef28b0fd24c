"""The half widths delta_i of the nested bands |f_i| < delta_i."""

from torch import Tensor

EPSILON = 0.3


def delta(f: Tensor) -> float:
    """Eq. 5: (1 + epsilon) max_j |f_i(x_j)|. f: values of f_i at the points x_j of the surface."""
    return (1 + EPSILON) * max(float(f.abs().max()), 1e-6)
