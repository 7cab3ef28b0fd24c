"""Distances between the surface of a nested field and that of a shape, in both directions.

Random lines that are uniform in a ball cross a surface at points that are uniform by its area (Crofton's formula). So
the crossings are samples of the field's surface, wherever it is: also of surface that the shape does not have.
"""

from collections.abc import Sequence

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor
from torch.nn.functional import cosine_similarity

from ..model.surface_figures import FAR, SurfaceFigures, SurfaceRecord
from . import sampling
from .measuring_config import ComparingConfig
from .networks.nested import field, nested_field_and_gradient
from .networks.network import Weights
from .shapes.mesh import MeshShape
from .shapes.shape import Doubles, Shape
from .tracing import ROWS, Rays, follow

SEED = 0xC0FFE
RADIUS = 1.02
"""Radius of the ball in which lines look for surface, as that of the grid of marching cubes."""
NEWTON = 4
"""Newton steps from a point to the zero level set."""
FLATTEST = 0.1
"""Least |grad f| in a Newton step."""
LEFT = 0.02
"""Largest |f| after the steps, as a share of their length, of a point that has reached the surface."""


class SurfaceDistance:
    """Measures the surface of a nested field against a shape's."""

    def __init__(self, shape: Shape, device: torch.device, config: ComparingConfig | None = None) -> None:
        self._shape, self._device, self._config = shape, device, config or ComparingConfig()

    def measure(self, levels: Sequence[Weights], deltas: Sequence[float]) -> SurfaceRecord:
        """Measure the surface of all levels. deltas: half-widths of all bands."""
        shape, points = self._shape, self.samples(levels, deltas)
        flat = shape.with_flat_faces() if isinstance(shape, MeshShape) else None
        return SurfaceRecord(
            shape=self._against(shape, points, levels, deltas),
            flat=None if flat is None else self._against(flat, points, levels, deltas),
            open=isinstance(shape, MeshShape) and shape.open,
        )

    def samples(self, levels: Sequence[Weights], deltas: Sequence[float]) -> Doubles:
        """Draw points of the field's surface, uniform by area: (N, 3), or (N, 4) with a time. N depends on the area."""
        rays = self._lines()
        config = self._config.along
        found = follow(lambda at: _nested(levels, deltas, at), np.zeros(len(levels)), rays, RADIUS, config)
        inside = found.f < 0
        before = np.flatnonzero((found.ray[1:] == found.ray[:-1]) & (inside[1:] != inside[:-1]))
        here, there = np.abs(found.f[before]), np.abs(found.f[before + 1])
        t = found.t[before] + here / np.maximum(here + there, 1e-30) * (found.t[before + 1] - found.t[before])
        return _numpy(_on_surface(levels, deltas, rays.at(found.ray[before], t))[0])

    def seconds(self, levels: Sequence[Weights], each: float) -> float:
        """Estimate the seconds of `measure`. each: seconds of a value and a gradient of these networks at a point."""
        values = self._config.lines * self._config.expected_samples
        return each * (values / (2 * len(levels)) + 2 * NEWTON * self._config.points)

    def _lines(self) -> Rays:
        """Draw lines uniformly among those that meet the ball."""
        rng, count = np.random.default_rng(SEED), self._config.lines
        directions, across = (_unit(rng.normal(size=(count, 3))) for _ in range(2))
        across = _unit(np.cross(directions, across))
        aims = sampling.timed(RADIUS * np.sqrt(rng.random(count))[:, None] * across, self._shape.moving, rng)
        return Rays(self._tensor(aims), self._tensor(np.pad(directions, ((0, 0), (0, aims.shape[1] - 3)))))

    def _against(
        self, shape: Shape, ours: Doubles, levels: Sequence[Weights], deltas: Sequence[float]
    ) -> SurfaceFigures:
        """Compare samples `ours` of the field's surface, and the field, with a shape."""
        drawn = shape.surface(self._config.points, np.random.default_rng(SEED), held_out=True)
        start = self._tensor(drawn.points)
        reached, gradient, missed = _on_surface(levels, deltas, start)
        missing = np.linalg.norm(_numpy(reached)[:, :3] - drawn.points[:, :3], axis=1)
        if len(ours) and not shape.moving:  # A sample of the field's surface is an end, too, and may be nearer.
            missing[missed] = np.inf
            missing = np.minimum(missing, cKDTree(ours).query(drawn.points, workers=-1)[0])
        cosine = cosine_similarity(gradient[:, :3], self._tensor(drawn.normals), dim=1).clamp(-1, 1)
        distance = np.abs(shape.distance(ours)) if len(ours) else np.empty(0)
        known = np.isfinite(distance).sum() > len(distance) / 2
        return SurfaceFigures(
            distance_mean=float(np.nanmean(distance)) if known else None,
            missing_mean=float(missing.mean()),
            normal_angle=float(torch.rad2deg(torch.acos(cosine)).mean()),
            invented=float((distance > FAR).mean()) if known else None,
        )

    def _tensor(self, array: Doubles) -> Tensor:
        return torch.from_numpy(array.astype(np.float32)).to(self._device)


def _nested(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate the finest defined level as `nested_field` does, but each level only where it is defined."""
    f = field(levels[:1], points)
    reached = torch.ones(len(points), dtype=torch.int64, device=points.device)
    inside = torch.arange(len(points), device=points.device)
    for i in range(1, len(levels)):
        inside = inside[f[inside].abs() < deltas[i - 1]]
        if not len(inside):
            break
        again = torch.arange(-(-len(inside) // ROWS) * ROWS, device=points.device) % len(inside)
        f[inside] += field(levels[i : i + 1], points[inside[again]])[: len(inside)]
        reached[inside] = i + 1
    return f, reached


def _on_surface(
    levels: Sequence[Weights], deltas: Sequence[float], points: Tensor
) -> tuple[Tensor, Tensor, np.ndarray]:
    """Move points (N, 3) or (N, 4) to the zero level set by Newton's method, at their times.

    Returns the points, the gradients where they began, and a mask (N,) of those that did not reach it.
    """
    start, first = points, None
    for _ in range(NEWTON):
        f, gradient, _ = nested_field_and_gradient(levels, deltas, points)
        first = gradient if first is None else first
        slope = gradient.clone()
        slope[:, 3:] = 0
        points = points - (f / slope.square().sum(dim=1).clamp_min(FLATTEST**2))[:, None] * slope
    assert first is not None
    f = _nested(levels, deltas, points)[0]
    length = torch.linalg.vector_norm(points - start, dim=1)
    return points, first, _numpy(f.abs() > (LEFT * length).clamp_min(1e-6)) > 0


def _numpy(tensor: Tensor) -> Doubles:
    return tensor.cpu().numpy().astype(np.float64)


def _unit(vectors: Doubles) -> Doubles:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
