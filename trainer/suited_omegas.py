"""Frequencies that suit a shape: the smoother it is, the lower its networks' omega_0.

Frequencies that a shape does not need remain as ripples of the normals (docs/lessons.md).
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from .config import BendConfig, default_config
from .settings import default_omega
from .shapes.shape import Shape

SEED = 0xBE4D
FEWEST = 100  # pairs of points that a median needs


def suited_omegas(
    shape: Shape, networks: Sequence[tuple[int, int]], say: Callable[[str], None] | None = None
) -> tuple[float, ...]:
    """Return omega_0 of each level that suits a shape. networks: (width, depth) of each. say: logs lower ones."""
    share = roughness(bend_of(shape))
    omegas = tuple(suited_omega(i, width, share) for i, (width, _) in enumerate(networks))
    if share < 1 and say is not None:
        say(f"omega: {', '.join(f'{omega:g}' for omega in omegas)}; lower than usual, since the shape is smooth")
    return omegas


def suited_omega(index: int, width: int, share: float) -> float:
    """Return omega_0 of level `index`, from 0, of a shape with this roughness."""
    smooth, usual = default_config().bend.omegas, default_omega(index, width)
    least = min(usual, smooth[min(index, len(smooth) - 1)])
    return round(least + share * (usual - least), 1)


def roughness(bend: float, config: BendConfig | None = None) -> float:
    """Return where a bend, degrees, is between smooth, 0, and rough, 1."""
    config = config or default_config().bend
    return float(np.clip((bend - config.smooth) / (config.rough - config.smooth), 0, 1))


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
