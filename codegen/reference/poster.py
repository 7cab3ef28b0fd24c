"""A small picture of a model, drawn in numpy: what a page shows until its first frame."""

import numpy as np
from numpy.typing import NDArray

from ...model.srgb import Values, to_linear, to_srgb
from ..ir.program import Array, Program
from .interpret import colour, field_gradient
from .march import march

COSTLIEST = 40_000
"""Most multiply-adds that a value of the level drawn costs; of dearer models a coarser level is drawn."""
ROUNDS = 8
"""How often rays go through the levels: enough for all but those that graze a silhouette."""
SKY, GROUND, KEY = np.array([[0.34, 0.38, 0.46], [0.16, 0.13, 0.12], [1.0, 0.96, 0.9]])

Pixels = NDArray[np.float64]


def poster(
    program: Program, basis: Pixels, distance: float, focal: float, light: Pixels, plain: Pixels, side: int
) -> Pixels:
    """Draw a model as the shaders do with their default options (glsl/main.glsl, glsl/phong.glsl), four rays a pixel.

    basis: (3, 3), columns right, up and back of a camera that looks at the origin from `distance`, model units.
    focal: distance of the picture plane that reaches from -1 to 1. light: (3,), the direction to the light in the
    camera's axes. plain: (3,), the sRGB colour of a model without colours. side: pixels.

    Returns (side, side, 4), top row first: sRGB in [0, 1], and the share of the pixel that the shape covers.
    """
    rays = 2 * side
    across = (2 * np.arange(rays) + 1 - rays) / rays
    x, y = np.meshgrid(across, -across)
    directions = np.stack((x, y, np.full(x.shape, -focal)), axis=-1).reshape(-1, 3) @ basis.T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    eye = distance * basis[:, 2]
    level = _affordable(program)
    traced = march(program, eye, directions, level, 2 / (focal * rays), ROUNDS)
    hit = traced.hit
    points = (eye + traced.t[hit, None] * directions[hit]).astype(np.float32)
    normals, _ = field_gradient(program, points, level)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    albedo = np.broadcast_to(plain, points.shape) if not program.coloured else colour(program, points)
    toward = basis @ (light / np.linalg.norm(light))
    lit = _phong(to_linear(albedo), normals, -directions[hit], toward, basis[:, 1])
    samples = np.zeros((len(directions), 4))
    samples[hit] = np.concatenate((np.clip(lit, 0, 1), np.ones((len(lit), 1))), axis=1)
    means = samples.reshape(side, 2, side, 2, 4).mean(axis=(1, 3))
    covered = np.maximum(means[..., 3:], 1e-9)
    return np.concatenate((to_srgb(means[..., :3] / covered), means[..., 3:]), axis=-1)


def _affordable(program: Program) -> int:
    """Choose the finest level whose values are not too dear; level 1 where all are."""
    costs = np.cumsum([cost.multiply_adds for cost in program.value_costs()])
    return max(1, int((costs <= COSTLIEST).sum()))


def _phong(albedo: Values, normal: Array, view: Pixels, light: Pixels, up: Pixels) -> Pixels:
    """Shade as glsl/phong.glsl does. albedo, and what is returned: (N, 3), linear light."""
    facing = normal @ light
    reflected = 2 * facing[:, None] * normal - light
    highlight = np.maximum((reflected * view).sum(axis=1), 0) ** 48
    rim = (1 - np.maximum((normal * view).sum(axis=1), 0)) ** 4
    above = (0.5 + 0.5 * normal @ up)[:, None]
    ambient = GROUND + (SKY - GROUND) * above
    lit = albedo * (ambient + 1.05 * np.maximum(facing, 0)[:, None] * KEY)
    lit = lit + (0.14 * highlight + 0.10 * rim)[:, None]
    over = np.maximum(lit - 0.6, 0)
    return np.asarray(lit - over + over / (1 + 2 * over))
