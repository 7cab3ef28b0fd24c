"""Photographs whose cameras are known, in model space: what `photos` learns a shape from (Appendix F)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Posed:
    """One photograph, with a pinhole camera whose place is known."""

    name: str
    """Of its file."""
    colours: NDArray[np.uint8]
    """(H, W, 3), sRGB."""
    mask: NDArray[np.bool_] | None
    """(H, W), true where the object is; None where nothing tells."""
    eye: Doubles
    """(3,), where the camera is, model space."""
    rays: Doubles
    """(3, 3), from a point (u, v, 1) of the picture to the direction in which it is seen.

    u goes right and v down, in pixels of `colours`, from the upper left corner of the picture.
    """

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.colours.shape[1], self.colours.shape[0]

    def directions(self) -> Doubles:
        """Return the directions (H, W, 3) of the rays through the pixels' centres, of length 1."""
        width, height = self.size
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        directions = np.stack([u, v, np.ones_like(u)], axis=-1) @ self.rays.T
        return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Photographs:
    """The photographs of one object."""

    name: str
    """Of the folder that they are in."""
    views: tuple[Posed, ...]
    centre: tuple[float, float, float]
    """Where model space's origin lies in the cameras' space, turned upright."""
    scale: float
    """Length of model space's unit in the cameras' space."""
    up: str
    """Axis of the cameras' space that points up; in model space it is y."""

    @property
    def masked(self) -> bool:
        """Whether every photograph has a mask."""
        return all(view.mask is not None for view in self.views)

    def front(self) -> tuple[float, float]:
        """Return the azimuth and the elevation, in degrees, of the camera that is nearest to the middle of all."""
        eyes = np.array([view.eye for view in self.views])
        towards = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
        x, y, z = towards[(towards @ towards.mean(axis=0)).argmax()]
        return float(np.degrees(np.arctan2(x, z))), float(np.degrees(np.arcsin(np.clip(y, -1, 1))))


def split(photographs: Photographs, every: int) -> tuple[list[Posed], list[Posed]]:
    """Divide the views into those to learn from, and every k-th, which is kept out to measure by; 0: none is."""
    kept = set(range(every // 2, len(photographs.views), every)) if every else set()
    return (
        [view for i, view in enumerate(photographs.views) if i not in kept],
        [view for i, view in enumerate(photographs.views) if i in kept],
    )
