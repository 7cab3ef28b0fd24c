"""Photographs with known cameras, in model space: the input of `photos` (Appendix F)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cloud import Doubles


@dataclass(frozen=True, eq=False)
class Photograph:
    """One photograph with its pinhole camera."""

    name: str
    """Name of its file."""
    colors: NDArray[np.uint8]
    """(H, W, 3), sRGB."""
    mask: NDArray[np.bool_] | None
    """(H, W), true on the object; None without a mask."""
    eye: Doubles
    """(3,), position of the camera, model space."""
    rays: Doubles
    """(3, 3), maps (u, v, 1) to the direction of its ray.

    u points right and v down, in pixels of `colors`, from the upper left corner.
    """

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.colors.shape[1], self.colors.shape[0]

    def directions(self) -> Doubles:
        """Return the unit directions (H, W, 3) of the rays through the pixels' centers."""
        width, height = self.size
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        directions = np.stack([u, v, np.ones_like(u)], axis=-1) @ self.rays.T
        return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Photographs:
    """The photographs of one object."""

    name: str
    """Name of their folder."""
    views: tuple[Photograph, ...]
    center: tuple[float, float, float]
    """Origin of model space in the cameras' space, turned upright."""
    scale: float
    """Length of one model unit in the cameras' space."""
    up: str
    """Axis of the cameras' space that points up; it is y in model space."""

    @property
    def masked(self) -> bool:
        """Whether every photograph has a mask."""
        return all(view.mask is not None for view in self.views)

    def front(self) -> tuple[float, float]:
        """Return azimuth and elevation, degrees, of the camera nearest to the mean direction of all cameras."""
        eyes = np.array([view.eye for view in self.views])
        towards = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
        x, y, z = towards[(towards @ towards.mean(axis=0)).argmax()]
        return float(np.degrees(np.arctan2(x, z))), float(np.degrees(np.arcsin(np.clip(y, -1, 1))))


def split(photographs: Photographs, every: int) -> tuple[list[Photograph], list[Photograph]]:
    """Divide the views into training views and every `every`-th view for evaluation; 0: no evaluation."""
    held_out = set(range(every // 2, len(photographs.views), every)) if every else set()
    return (
        [view for i, view in enumerate(photographs.views) if i not in held_out],
        [view for i, view in enumerate(photographs.views) if i in held_out],
    )
