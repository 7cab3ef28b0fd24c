"""Photographs of a mesh from around it, as files in the layout of IDR and NeuS: pyrender's pictures, exact masks."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from mplicits.trainer.shapes.shape import normalize
from mplicits.viewer.draw.camera import Camera
from support.pyrender_mesh import PyrenderMesh


def around(count: int, elevation: float, first: float = 0.0) -> list[Camera]:
    """Return cameras evenly around the unit sphere at one elevation, in degrees; first: the first one's azimuth."""
    return [Camera((first + 360 * k / count) % 360, elevation) for k in range(count)]


def projection(camera: Camera, size: int) -> NDArray[np.float64]:
    """Return the matrix (4, 4) from model space to pixels, whose centers are whole numbers, of a square picture."""
    to_camera = np.linalg.inv(camera.matrix().astype(np.float64))
    focal = camera.focal * size / 2
    middle = (size - 1) / 2
    intrinsics = np.array([[focal, 0, middle, 0], [0, focal, middle, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    return np.asarray(intrinsics @ np.diag([1.0, -1.0, -1.0, 1.0]) @ to_camera)


def write_photographs(folder: Path, mesh_file: Path, cameras: list[Camera], size: int) -> None:
    """Draw a mesh, normalized as for training, and write image/, mask/ and cameras_sphere.npz."""
    mesh = trimesh.load_mesh(mesh_file, process=False)
    _, center, scale = normalize(np.asarray(mesh.vertices, np.float64))
    drawn = PyrenderMesh(mesh, center, scale, (size, size))
    for part in ("image", "mask"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    matrices: dict[str, Any] = {}
    for i, camera in enumerate(cameras):
        colors, depth = drawn(camera)
        Image.fromarray(np.round(255 * colors).astype(np.uint8)).save(folder / "image" / f"{i:03}.png")
        Image.fromarray((255 * (depth > 0)).astype(np.uint8)).save(folder / "mask" / f"{i:03}.png")
        matrices |= {f"world_mat_{i}": projection(camera, size), f"scale_mat_{i}": np.eye(4)}
    drawn.release()
    np.savez(folder / "cameras_sphere.npz", **matrices)
