"""Frequencies that suit a shape: the smoother it is, the lower its networks' omega_0.

Frequencies that a shape does not need remain as ripples of the normals (benchmarks/grain.py).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from .config import BendConfig, default_config
from .settings import Settings, default_omega
from .shapes.shape import Shape

SEED = 0xBE4D
FEWEST = 100  # pairs of points that a median needs


def with_suited_omegas(shape: Shape, settings: Settings, say: Callable[[str], None] | None = None) -> Settings:
    """Return settings with the default frequencies times the factor that suits a shape. say: logs them."""
    factor = omega_factor(bend_of(shape))
    if factor == 1:
        return settings
    omegas = tuple(default_omega(i, width, factor) for i, (width, _) in enumerate(settings.networks))
    if say is not None:
        listed = ", ".join(f"{omega:g}" for omega in omegas)
        say(f"omega: {listed}; {factor:.2g} of the default, since the shape is smooth")
    return replace(settings, omegas=omegas)


def omega_factor(bend: float, config: BendConfig | None = None) -> float:
    """Return the factor on the default omega_0 of a shape with this bend, degrees."""
    config = config or default_config().bend
    share = (bend - config.smooth) / (config.rough - config.smooth)
    return config.least + (1 - config.least) * float(np.clip(share, 0, 1))


def bend_of(shape: Shape, config: BendConfig | None = None) -> float:
    """Measure the bend of a shape: the median angle, degrees, between the normals of neighboring surface points.

    The median ignores sharp edges. Returns infinity where there are too few neighbors, and for shapes that move.
    """
    config = config or default_config().bend
    if shape.moving:
        return np.inf
    drawn = shape.surface(config.points, np.random.default_rng(SEED))
    first, second = cKDTree(drawn.points).query_pairs(config.farthest, output_type="ndarray").T
    distance = np.linalg.norm(drawn.points[first] - drawn.points[second], axis=1)
    cosine = np.einsum("ij,ij->i", drawn.normals[first], drawn.normals[second])
    same_side = cosine[(distance > config.nearest) & (cosine > 0)]
    return float(np.degrees(np.median(np.arccos(np.minimum(same_side, 1))))) if len(same_side) >= FEWEST else np.inf
