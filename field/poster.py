"""A small picture of a model, drawn in NumPy: the page shows it until its first frame."""

import numpy as np
from numpy.typing import NDArray

from ..ir.lower import lower
from ..ir.program import Array, Program
from ..model.model import Model
from ..model.srgb import Values, to_linear, to_srgb
from .evaluate import Evaluator
from .lowest import lowest_point
from .openness import openness
from .trace import trace

COSTLIEST = 40_000
"""Largest number of multiply-adds for one value of the drawn level; of larger models, a coarser level is drawn."""
NEAR = 0.1
"""Largest f of a hit, in widths of a ray's pixel."""
SKY, GROUND, KEY = np.array([[0.34, 0.38, 0.46], [0.16, 0.13, 0.12], [1.0, 0.96, 0.9]])
"""Colors of the light in glsl/functions/phong.glsl."""
FLOOR_LIGHT, SKY_LIGHT, KEY_LIGHT = np.array([[0.30, 0.28, 0.26], [0.40, 0.43, 0.48], [1.0, 0.97, 0.92]])
"""Colors of the light in glsl/functions/softbox.glsl."""

Pixels = NDArray[np.float64]


def poster(
    model: Model,
    basis: Pixels,
    distance: float,
    focal: float,
    light: Pixels,
    plain: Pixels,
    side: int,
    shade: str = "phong",
) -> Pixels:
    """Draw a model as the shaders do with their default options (main.glsl), at time 0, with four rays a pixel.

    basis: (3, 3), columns right, up and back of a camera that faces the
    origin from `distance`, model units. focal: distance of a picture plane from -1 to 1. light: (3,), direction to the
    light in the camera's axes. plain: (3,), sRGB color of a model without colors. side: pixels. shade: "phong", or
    "softbox", without its floor. Returns (side, side, 4), top row first: sRGB in [0, 1], and coverage.
    """
    program, evaluator = lower(model), Evaluator(model)
    level = _affordable(program)
    rays = 2 * side
    across = (2 * np.arange(rays) + 1 - rays) / rays
    x, y = np.meshgrid(across, -across)
    directions = np.stack((x, y, np.full(x.shape, -focal)), axis=-1).reshape(-1, 3) @ basis.T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.tile(distance * basis[:, 2], (len(directions), 1))
    pixel = 2 / (focal * rays) * distance
    t = trace(model, evaluator, origins, directions, level, near=NEAR * pixel)
    hit = np.isfinite(t)
    points = (origins[hit] + t[hit, None] * directions[hit]).astype(np.float32)
    normals = evaluator.gradient(points, level)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = evaluator.color(points)
    albedo = to_linear(np.broadcast_to(plain, points.shape) if colors is None else colors)
    toward = light / np.linalg.norm(light)
    if shade == "softbox":
        lit = _softbox(program, points, albedo, normals, -directions[hit], _key_light(toward, basis))
    else:
        lit = _phong(albedo, normals, -directions[hit], basis @ toward, basis[:, 1])
    samples = np.zeros((len(directions), 4))
    samples[hit] = np.concatenate((np.clip(lit, 0, 1), np.ones((len(lit), 1))), axis=1)
    means = samples.reshape(side, 2, side, 2, 4).mean(axis=(1, 3))
    covered = np.maximum(means[..., 3:], 1e-9)
    return np.concatenate((to_srgb(means[..., :3] / covered), means[..., 3:]), axis=-1)


def _affordable(program: Program) -> int:
    """Choose the finest level that costs at most COSTLIEST, or level 1."""
    costs = np.cumsum([cost.multiply_adds for cost in program.value_costs()])
    return max(1, int((costs <= COSTLIEST).sum()))


def _phong(albedo: Values, normal: Array, view: Pixels, light: Pixels, up: Pixels) -> Pixels:
    """Shade as glsl/functions/phong.glsl. albedo and result: (N, 3), linear light."""
    facing = normal @ light
    reflected = 2 * facing[:, None] * normal - light
    highlight = np.maximum((reflected * view).sum(axis=1), 0) ** 48
    rim = (1 - np.maximum((normal * view).sum(axis=1), 0)) ** 4
    above = (0.5 + 0.5 * normal @ up)[:, None]
    ambient = GROUND + (SKY - GROUND) * above
    lit = albedo * (ambient + 1.05 * np.maximum(facing, 0)[:, None] * KEY)
    return _shouldered(lit + (0.14 * highlight + 0.10 * rim)[:, None])


def _key_light(light: Pixels, basis: Pixels) -> Pixels:
    """Return the direction to the key light, model space (key_light.glsl). light: camera space."""
    right = basis[:, 0]
    toward = light[0] * right + np.array([0, max(light[1], 0.35), 0])
    toward = toward + light[2] * np.array([-right[2], 0, right[0]])
    return np.asarray(toward / np.linalg.norm(toward))


def _softbox(program: Program, points: Array, albedo: Values, normal: Array, view: Pixels, light: Pixels) -> Pixels:
    """Shade points (N, 3) as glsl/functions/softbox.glsl. albedo and result: (N, 3), linear light."""
    ground = lowest_point(program)
    opened = openness(program, points.astype(np.float64), normal.astype(np.float64), light, ground, floored=False)
    sky = opened[:, 0] * np.clip(1 + 0.6 * opened[:, 2] / program.bands[0].delta, 0.5, 1)
    facing = normal @ light
    key = opened[:, 1] * np.maximum(facing, 1.25 * np.clip(facing + 0.2, 0, 0.4) ** 2)
    rise = np.clip(0.5 + 0.5 * normal[:, 1], 0, 1)
    above = (rise * rise * (3 - 2 * rise))[:, None]
    height = np.maximum(points[:, 1] - ground, 0)
    from_floor = (np.sqrt(sky) * (1 - 0.75 / (1 + 4 * height)))[:, None] * FLOOR_LIGHT
    diffuse = from_floor + (sky[:, None] * SKY_LIGHT - from_floor) * above + 0.86 * key[:, None] * KEY_LIGHT
    toward_eye = (normal * view).sum(axis=1)
    mirrored = 2 * toward_eye[:, None] * normal - view
    sheen = np.clip((mirrored[:, 1] + 0.2) / 1.1, 0, 1)
    fresnel = 0.04 + 0.5 * (1 - np.maximum(toward_eye, 0)) ** 5
    gloss = 0.9 * fresnel * sky * sheen * sheen * (3 - 2 * sheen)
    gloss = gloss + 0.1 * opened[:, 1] * np.maximum(mirrored @ light, 0) ** 40
    return _shouldered(albedo * diffuse + gloss[:, None])


def _shouldered(lit: Pixels) -> Pixels:
    """Compress bright shades, so that they do not all clip to 1, as both shaders do."""
    over = np.maximum(lit - 0.6, 0)
    return np.asarray(lit - over + over / (1 + 2 * over))
