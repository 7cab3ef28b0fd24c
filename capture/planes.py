"""Planes through the neighbourhood of each pixel of a depth map: normals, and depths with less noise.

A plane of space is an affine function of the pixel in inverse depth, whatever the perspective: where n.X = 1 on it,
1 / z = n.(x, y, 1) for the pixel whose ray meets the plane at distance 1 in (x, y). So a plane is three sums of a
window's pixels, and its coefficients are its normal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

STEEP = 6.0
"""A neighbour is of the same surface where the slope to it, depth over width, is at most this: 80 degrees."""
SURE = 4.0
"""Standard deviations of the noise by which a neighbour may differ besides."""
STEADY = 0.05
"""Standard deviation of a plane's slope that its window is made large enough for."""
WIDEST = 12
"""Largest radius of a window, in pixels."""
ROUNDS = 2
"""How often a plane is fitted again without the pixels that it does not fit."""


@dataclass(frozen=True, eq=False)
class Planes:
    """What was found at each pixel of a depth map; NaN where there was too little to find it by."""

    depth: Doubles
    """(H, W), of the plane, along the axis."""
    normals: Doubles
    """(H, W, 3), of length 1, toward the camera; x points right, y down, z away from the camera."""
    facing: Doubles
    """(H, W), cosine of the angle between the normal and the way to the camera."""
    support: Doubles
    """(H, W), share of the window's pixels that lie on the plane."""
    residual: Doubles
    """(H, W), by how much the pixel's own depth differs from the plane's, as a share of it."""
    noise: float
    """Standard deviation of the depths, as a share of them, as it was measured."""


def fit_planes(depth: Doubles, x: Doubles, y: Doubles, step: Doubles | float = 0.0) -> Planes:
    """Fit a plane to the neighbourhood of each pixel.

    depth: (H, W), along the axis, NaN where there is nothing. x (W,), y (H,): where the pixels' rays meet the plane at
    distance 1. step: to which the depths are rounded, as a share of them.
    """
    inverse = 1 / depth
    pitch = float(np.sqrt(abs((x[1] - x[0]) * (y[1] - y[0]))))
    noise = float(np.hypot(_noise(inverse), np.nanmean(step) / np.sqrt(12)))
    radius = _radius(noise / pitch)
    coefficients, support = _fit(inverse, pitch, noise, radius)
    smooth = coefficients[..., 2]
    # The coefficients are of steps in pixels; those of x, y and 1 follow.
    across, down = coefficients[..., 0] / (x[1] - x[0]), coefficients[..., 1] / (y[1] - y[0])
    normals = np.stack([across, down, smooth - across * x - down * y[:, None]], axis=-1)
    lengths = np.linalg.norm(normals, axis=-1)
    rays = np.sqrt(1 + x**2 + y[:, None] ** 2)
    with np.errstate(invalid="ignore"):
        ahead = smooth > 0
    found = np.where(ahead, 1 / np.where(ahead, smooth, 1), np.nan)
    return Planes(
        found, -normals / lengths[..., None], smooth / (lengths * rays), support, np.abs(found / depth - 1), noise
    )


def _noise(inverse: Doubles) -> float:
    """Measure the noise by second differences, which a plane does not have: standard deviation over the value."""
    second = [np.diff(inverse, 2, axis=axis) / np.delete(inverse, [0, -1], axis=axis) for axis in (0, 1)]
    values = np.abs(np.concatenate([part[~np.isnan(part)] for part in second]))
    return 1.4826 * float(np.median(values)) / np.sqrt(6) if len(values) else 0.0


def _radius(noise: float) -> int:
    """Choose a window's radius by the noise over a pixel's width.

    The slope by a square window of side s has the standard deviation noise * sqrt(12) / s^2.
    """
    side = np.sqrt(noise * np.sqrt(12) / STEADY)
    return int(np.clip(np.ceil((side - 1) / 2), 1, WIDEST))


def _fit(inverse: Doubles, pitch: float, noise: float, radius: int) -> tuple[Doubles, Doubles]:
    """Fit inverse depths by a * dx + b * dy + c around each pixel, dx and dy in pixels.

    Returns a, b, c, (H, W, 3), and the share of the window's pixels that the last fit was made by, (H, W).
    """
    coefficients = np.zeros((*inverse.shape, 3))
    coefficients[..., 2] = inverse
    steep = STEEP * pitch
    offsets = [(dy, dx) for dy in range(-radius, radius + 1) for dx in range(-radius, radius + 1)]
    support = np.zeros(inverse.shape)
    (height, width), padded = inverse.shape, np.pad(inverse, radius, constant_values=np.nan)
    for round_ in range(ROUNDS + 1):
        sums = np.zeros((9, *inverse.shape))
        support[:] = 0
        bend = steep if round_ == 0 else steep / 4  # a fitted plane leaves only the curvature
        for dy, dx in offsets:
            there = padded[radius + dy : radius + dy + height, radius + dx : radius + dx + width]
            plane = coefficients[..., 0] * dx + coefficients[..., 1] * dy + coefficients[..., 2]
            allowed = (bend * max(abs(dx), abs(dy), 1) + SURE * noise) * plane
            with np.errstate(invalid="ignore"):
                weight = np.where(np.abs(there - plane) <= allowed, _window(dx, dy, radius), 0.0)
            value = np.where(weight > 0, there, 0.0)
            support += weight > 0
            factors = (1, dx, dy, dx * dx, dx * dy, dy * dy, value, dx * value, dy * value)
            for index, factor in enumerate(factors):
                sums[index] += weight * factor
        coefficients = _solve(sums)
    return coefficients, support / len(offsets)


def _window(dx: int, dy: int, radius: int) -> float:
    """Return the weight of a neighbour: 1 in the middle, a quarter at the window's side."""
    return float(1 / (1 + 3 * max(abs(dx), abs(dy)) ** 2 / max(radius, 1) ** 2))


def _solve(sums: Doubles) -> Doubles:
    """Solve the normal equations of the nine sums (9, H, W); NaN where they do not determine a plane."""
    one, x, y, xx, xy, yy, v, xv, yv = sums
    matrix = np.stack([np.stack(row, axis=-1) for row in ((xx, xy, x), (xy, yy, y), (x, y, one))], axis=-2)
    right = np.stack([xv, yv, v], axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        determined = np.linalg.det(matrix) > 1e-6 * np.maximum(one, 1e-9) ** 3
    matrix[~determined] = np.eye(3)
    solution: Doubles = np.linalg.solve(matrix, right[..., None])[..., 0]
    solution[~determined] = np.nan
    return solution
