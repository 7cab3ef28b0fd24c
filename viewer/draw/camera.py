"""An orbit camera around the unit sphere of model space."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError

AZIMUTH, ELEVATION, FOV = 30.0, 20.0, 35.0
FARTHEST = 1000.0
MARGIN = 1.06
"""The default distance shows a sphere of this radius (the unit sphere and some air)."""


@dataclass(frozen=True)
class Camera:
    """Looks at `target` from `distance` (model units). The y axis is up.

    azimuth: degrees around the y axis, 0 on +z, 90 on +x. elevation: degrees above the xz plane.
    distance: None for one from which the unit sphere fits. fov: vertical field of view, degrees.
    aspect: width / height of the picture that it must fit.
    """

    azimuth: float = AZIMUTH
    elevation: float = ELEVATION
    distance: float | None = None
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fov: float = FOV
    aspect: float = 1.0

    def __post_init__(self) -> None:
        if not 1.0 <= self.fov <= 150.0:
            raise UserError(f"field of view {self.fov:g}: between 1 and 150 degrees")
        if not 0.0 < self.away <= FARTHEST:
            raise UserError(f"camera distance {self.away:g}: more than 0, at most {FARTHEST:g} (the shape has 1)")
        if not all(math.isfinite(number) for number in (self.azimuth, self.elevation, *self.target)):
            raise UserError("camera: every number must be finite")

    @property
    def away(self) -> float:
        """Distance to the target."""
        if self.distance is not None:
            return self.distance
        return min(FARTHEST, MARGIN / math.sin(math.atan(min(1.0, self.aspect) / self.focal)))

    @property
    def focal(self) -> float:
        """1 / tan(fov / 2)."""
        return 1.0 / math.tan(math.radians(self.fov) / 2)

    def matrix(self) -> NDArray[np.float32]:
        """(4, 4) camera to model space; columns right, up, back, eye."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        sin_a, cos_a, sin_e, cos_e = math.sin(azimuth), math.cos(azimuth), math.sin(elevation), math.cos(elevation)
        matrix = np.eye(4)
        matrix[:3, 0] = cos_a, 0.0, -sin_a
        matrix[:3, 1] = -sin_e * sin_a, cos_e, -sin_e * cos_a
        matrix[:3, 2] = cos_e * sin_a, sin_e, cos_e * cos_a
        matrix[:3, 3] = self.target + self.away * matrix[:3, 2]
        return matrix.astype(np.float32)

    def rays(self, width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """The shader's rays in numpy, for checks: eye (3,), directions (height, width, 3) of length 1, top row first,
        and the width of a pixel at distance 1.
        """
        x, y = np.meshgrid(2 * np.arange(width) + 1 - width, height - 1 - 2 * np.arange(height))
        plane = np.stack([x / height, y / height, np.full(x.shape, -self.focal)], axis=-1)
        matrix = self.matrix().astype(np.float64)
        directions = plane @ matrix[:3, :3].T
        return matrix[:3, 3], directions / np.linalg.norm(directions, axis=-1, keepdims=True), 2 / (self.focal * height)

    def orbited(self, azimuth: float, elevation: float) -> "Camera":
        """Turned by so many degrees; elevation stays within the poles."""
        return replace(
            self, azimuth=(self.azimuth + azimuth) % 360.0, elevation=min(90.0, max(-90.0, self.elevation + elevation))
        )

    def zoomed(self, factor: float) -> "Camera":
        """`factor` times as far away."""
        return replace(self, distance=min(100.0, max(0.05, self.away * factor)))

    def panned(self, right: float, up: float) -> "Camera":
        """Target moved by model units along the picture's axes."""
        moved = np.asarray(self.target) + self.matrix()[:3, :2].astype(float) @ (right, up)
        return replace(self, target=(float(moved[0]), float(moved[1]), float(moved[2])))
