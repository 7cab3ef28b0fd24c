"""Photographs of a colored ball, computed by its formula, as folders in both layouts."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Doubles = NDArray[np.float64]

FOCAL = 1.6
"""Focal length, in sides of a picture."""
RADIUS = 0.6
DISTANCE = 3.0
"""Of the cameras from the ball's center."""


def poses(count: int) -> list[Doubles]:
    """Return matrices (4, 4) from cameras, which look along -z with y up, to space; they look at the origin."""
    found = []
    for k in range(count):
        azimuth, elevation = 2 * np.pi * k / count, 0.5 * np.sin(2.4 * k)
        back = np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
        right = np.cross([0, 1, 0], back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :4] = np.stack([right, np.cross(back, right), back, DISTANCE * back], axis=1)
        found.append(pose)
    return found


def seen(pose: Doubles, size: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Compute the picture (size, size, 3) and the mask of the ball; its color is that of its points."""
    x, y = np.meshgrid(np.arange(size) + 0.5 - size / 2, size / 2 - np.arange(size) - 0.5)
    plane = np.stack([x, y, np.full(x.shape, -FOCAL * size)], axis=-1)
    directions = plane @ pose[:3, :3].T
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    eye = pose[:3, 3]
    along = directions @ eye
    root = along**2 - eye @ eye + RADIUS**2
    hit = root > 0
    points = eye + (-along - np.sqrt(np.maximum(root, 0)))[..., None] * directions
    colors = np.where(hit[..., None], 0.5 + 0.4 * points / RADIUS, 0.0)
    return np.round(255 * colors).astype(np.uint8), hit


def write_sphere_layout(folder: Path, count: int, size: int, *, masks: bool = True) -> None:
    """Write image/, mask/ and cameras_sphere.npz; pixels' centers are whole numbers there."""
    (folder / "image").mkdir(parents=True)
    matrices: dict[str, Any] = {}
    middle = (size - 1) / 2
    intrinsics = np.array([[FOCAL * size, 0, middle, 0], [0, FOCAL * size, middle, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    for i, pose in enumerate(poses(count)):
        colors, hit = seen(pose, size)
        Image.fromarray(colors).save(folder / "image" / f"{i:03}.png")
        if masks:
            (folder / "mask").mkdir(exist_ok=True)
            Image.fromarray((255 * hit).astype(np.uint8)).save(folder / "mask" / f"{i:03}.png")
        # Scaled and moved, so that the unit ball is to be found by scale_mat.
        scale = np.diag([2.0, 2.0, 2.0, 1.0])
        scale[:3, 3] = 5, 6, 7
        to_pixels = intrinsics @ np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(pose) @ np.linalg.inv(scale)
        matrices |= {f"world_mat_{i}": to_pixels, f"scale_mat_{i}": scale}
    np.savez(folder / "cameras_sphere.npz", **matrices)


def write_transforms_layout(folder: Path, count: int, size: int) -> None:
    """Write pictures with transparency and transforms.json."""
    folder.mkdir(parents=True)
    frames = []
    for i, pose in enumerate(poses(count)):
        colors, hit = seen(pose, size)
        Image.fromarray(np.dstack([colors, (255 * hit).astype(np.uint8)])).save(folder / f"{i:03}.png")
        frames.append({"file_path": f"./{i:03}", "transform_matrix": pose.tolist()})
    shared = {"fl_x": FOCAL * size, "fl_y": FOCAL * size, "cx": size / 2, "cy": size / 2, "w": size, "h": size}
    (folder / "transforms.json").write_text(json.dumps(shared | {"frames": frames}))
