"""A camera that orbits around the unit sphere of model space."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.camera import basis, fitting_distance
from ...codegen.targets.orbit import AZIMUTH, ELEVATION, FOV, ZOOM
from ...model.errors import UserError

FARTHEST = 1000.0
"""Largest distance from the target, in model units."""


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a target point; y is up. Raises UserError if a number is out of range."""

    azimuth: float = AZIMUTH
    """Degrees around the y axis: 0 on +z, 90 on +x."""
    elevation: float = ELEVATION
    """Degrees above the xz plane."""
    distance: float | None = None
    """Distance from the target, model units; None: as near as the unit sphere still fits into the picture."""
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Model space."""
    fov: float = FOV
    """Vertical field of view, in degrees."""
    aspect: float = 1.0
    """Width / height of the picture; only the default distance depends on it."""

    def __post_init__(self) -> None:
        if not 1.0 <= self.fov <= 150.0:
            raise UserError(f"field of view {self.fov:g}: between 1 and 150 degrees")
        if not 0.0 < self.away <= FARTHEST:
            raise UserError(f"camera distance {self.away:g}: more than 0, at most {FARTHEST:g} (the shape has 1)")
        if not all(math.isfinite(number) for number in (self.azimuth, self.elevation, *self.target)):
            raise UserError("camera: every number must be finite")

    @property
    def away(self) -> float:
        """Distance to the target, model units: `distance`, or its default."""
        if self.distance is not None:
            return self.distance
        return min(FARTHEST, fitting_distance(self.aspect, self.focal))

    @property
    def focal(self) -> float:
        """1 / tan(fov / 2)."""
        return 1.0 / math.tan(math.radians(self.fov) / 2)

    def matrix(self) -> NDArray[np.float32]:
        """Return the transform (4, 4) from camera to model space: columns right, up, back, eye."""
        matrix = np.eye(4)
        matrix[:3, :3] = basis(self.azimuth, self.elevation)
        matrix[:3, 3] = self.target + self.away * matrix[:3, 2]
        return matrix.astype(np.float32)

    def rays(self, width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return the rays through the pixel centers, as in glsl/functions/camera_ray.glsl, in model space.

        Returns the eye (3,), the unit directions (height, width, 3), top row first, and the footprint: the width of a
        pixel at distance 1.
        """
        x, y = np.meshgrid(2 * np.arange(width) + 1 - width, height - 1 - 2 * np.arange(height))
        plane = np.stack([x / height, y / height, np.full(x.shape, -self.focal)], axis=-1)
        matrix = self.matrix().astype(np.float64)
        directions = plane @ matrix[:3, :3].T
        return matrix[:3, 3], directions / np.linalg.norm(directions, axis=-1, keepdims=True), 2 / (self.focal * height)

    def orbited(self, azimuth: float, elevation: float) -> "Camera":
        """Return the camera turned around its target, degrees; the elevation stops at the poles."""
        return replace(
            self, azimuth=(self.azimuth + azimuth) % 360.0, elevation=min(90.0, max(-90.0, self.elevation + elevation))
        )

    def zoomed(self, factor: float) -> "Camera":
        """Return the camera at `factor` times the distance, clamped to ZOOM."""
        return replace(self, distance=min(ZOOM[1], max(ZOOM[0], self.away * factor)))

    def panned(self, right: float, up: float) -> "Camera":
        """Return the camera with its target moved along the picture's axes, model units."""
        moved = np.asarray(self.target) + self.matrix()[:3, :2].astype(float) @ (right, up)
        return replace(self, target=(float(moved[0]), float(moved[1]), float(moved[2])))
