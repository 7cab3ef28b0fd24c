"""The half widths delta_i of the nested bands |f_i| < delta_i."""

from torch import Tensor

from ..model.model import DELTA_FACTOR


def delta(f: Tensor) -> float:
    """Compute delta_i by Eq. 5 from the values of f_i at points of the surface."""
    return DELTA_FACTOR * max(float(f.abs().max()), 1e-6)
