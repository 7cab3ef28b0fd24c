"""Fits a plane to the neighborhood of each pixel of a depth map: normals, and depths with less noise.

Under perspective, a plane is an affine function of the pixel in inverse depth: where n.X = 1 on the plane,
1 / z = n.(x, y, 1) for the pixel whose ray meets the plane at distance 1 in (x, y). So a plane follows from sums over a
window's pixels, and its coefficients are its normal.
"""

from dataclasses import dataclass

import numpy as np

from .cloud import Doubles

STEEP = 6.0  # A neighbor belongs to the same surface if the slope to it, depth over width, is at most this: 80 degrees
SURE = 4.0  # standard deviations of the noise by which a neighbor may differ in addition
STEADY = 0.05  # largest standard deviation of a plane's slope, which determines the size of its window
WIDEST = 12  # largest radius of a window, pixels
ROUNDS = 2  # number of times a plane is fitted again, without the pixels that are off it


@dataclass(frozen=True, eq=False)
class Planes:
    """The planes of a depth map's pixels; NaN where there were too few pixels."""

    depth: Doubles
    """(H, W), of the plane, along the axis."""
    normals: Doubles
    """(H, W, 3), unit vectors towards the camera; x points right, y down, z away from the camera."""
    facing: Doubles
    """(H, W), cosine of the angle between the normal and the direction to the camera."""
    support: Doubles
    """(H, W), share of the window's pixels that lie on the plane."""
    residual: Doubles
    """(H, W), relative difference between the pixel's own depth and the plane's."""
    noise: float
    """Measured standard deviation of the depths, relative."""


def fit_planes(depth: Doubles, x: Doubles, y: Doubles, step: Doubles | float = 0.0) -> Planes:
    """Fit a plane to the neighborhood of each pixel.

    depth: (H, W), along the axis, NaN where missing. x (W,), y (H,): coordinates of the pixels' rays in the plane at
    distance 1. step: rounding step of the depths, relative.
    """
    inverse = 1 / depth
    pitch = float(np.sqrt(abs((x[1] - x[0]) * (y[1] - y[0]))))
    noise = float(np.hypot(_noise(inverse), np.nanmean(step) / np.sqrt(12)))
    radius = _radius(noise / pitch)
    coefficients, support = _fit(inverse, pitch, noise, radius)
    smooth = coefficients[..., 2]
    # Convert coefficients of pixel steps to coefficients of x, y and 1.
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
    """Measure the relative noise by second differences, which vanish on a plane."""
    second = [np.diff(inverse, 2, axis=axis) / np.delete(inverse, [0, -1], axis=axis) for axis in (0, 1)]
    values = np.abs(np.concatenate([part[~np.isnan(part)] for part in second]))
    return 1.4826 * float(np.median(values)) / np.sqrt(6) if len(values) else 0.0


def _radius(noise: float) -> int:
    """Choose a window's radius. noise: divided by a pixel's width.

    The slope in a square window of side s has the standard deviation noise * sqrt(12) / s^2.
    """
    side = np.sqrt(noise * np.sqrt(12) / STEADY)
    return int(np.clip(np.ceil((side - 1) / 2), 1, WIDEST))


def _fit(inverse: Doubles, pitch: float, noise: float, radius: int) -> tuple[Doubles, Doubles]:
    """Fit inverse depths by a * dx + b * dy + c around each pixel, dx and dy in pixels.

    Returns a, b, c, (H, W, 3), and the share (H, W) of the window's pixels in the last fit.
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
        bend = steep if round_ == 0 else steep / 4  # off a fitted plane, only curvature remains
        for dy, dx in offsets:
            neighbor = padded[radius + dy : radius + dy + height, radius + dx : radius + dx + width]
            plane = coefficients[..., 0] * dx + coefficients[..., 1] * dy + coefficients[..., 2]
            allowed = (bend * max(abs(dx), abs(dy), 1) + SURE * noise) * plane
            # 1 in the center, a quarter at the window's side
            share = float(1 / (1 + 3 * max(abs(dx), abs(dy)) ** 2 / max(radius, 1) ** 2))
            with np.errstate(invalid="ignore"):
                weight = np.where(np.abs(neighbor - plane) <= allowed, share, 0.0)
            value = np.where(weight > 0, neighbor, 0.0)
            support += weight > 0
            factors = (1, dx, dy, dx * dx, dx * dy, dy * dy, value, dx * value, dy * value)
            for index, factor in enumerate(factors):
                sums[index] += weight * factor
        coefficients = _solve(sums)
    return coefficients, support / len(offsets)


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
