"""Makes the textured shapes of the paper's table as mesh files: Spot and Bob are as published, the others are our own.

Earth is a UV sphere with the Blue Marble map. Egg is a surface of revolution, painted with bands, zigzags and dots.
Bunny is McGuire's unwrapped mesh; a solid pattern of stripes and spots is baked into its image by the texture
coordinates.
"""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from protocol import DATA

Doubles = NDArray[np.float64]
FOLDER = DATA / "textured"
ROWS, COLUMNS = 128, 256
"""Quadrangles of a surface of revolution, along its axis and around it."""
EARTH = (2700, 1350)
"""Width and height of the Earth's image, in pixels."""
IMAGE = 1024
"""Pixels per side of the Egg's image; the Bunny's has twice as many."""
BAKED = 3_000_000
"""Number of surface points whose colors fill the Bunny's image."""


def spot(_: Path) -> Path:
    """Find Spot (CC0), which is used as it is."""
    return FOLDER / "spot.obj"


def bob(_: Path) -> Path:
    """Find Bob (CC0), which is used as it is."""
    return FOLDER / "bob_tri.obj"


def earth(folder: Path) -> Path:
    """Write the Earth: a unit sphere with a photographic map."""
    Image.MAX_IMAGE_PIXELS = None
    image = Image.open(FOLDER / "earth_bluemarble_5400x2700.jpg").convert("RGB").resize(EARTH, Image.Resampling.BOX)
    return _revolved(folder / "earth.obj", lambda z: np.sqrt(np.maximum(1 - z * z, 0)), image)


def egg(folder: Path) -> Path:
    """Write the Egg: blunt below, pointed above."""
    v, u = np.meshgrid(1 - (np.arange(IMAGE) + 0.5) / IMAGE, (np.arange(IMAGE) + 0.5) / IMAGE, indexing="ij")
    return _revolved(
        folder / "egg.obj",
        lambda y: 0.72 * np.sqrt(np.maximum(1 - y * y, 0)) * (1 - 0.18 * y),
        Image.fromarray(_bytes(_painted(u, v))),
    )


def bunny(folder: Path) -> Path:
    """Write the Bunny: the larger of the published file's two components, with an image of ours."""
    with zipfile.ZipFile(FOLDER / "bunny_mcguire_uv.zip") as archive:
        name = next(name for name in archive.namelist() if name.endswith(".obj"))
        whole: Any = trimesh.load_mesh(io.BytesIO(archive.read(name)), file_type="obj", process=False)
    welded = whole.copy()
    welded.merge_vertices(merge_tex=True, merge_norm=True)
    one, other = welded.faces[:, :2].ravel(), welded.faces[:, 1:].ravel()
    edges = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(len(welded.vertices),) * 2)
    piece = connected_components(edges, directed=False)[1][welded.faces[:, 0]]
    faces = whole.faces[piece == np.bincount(piece).argmax()]
    uv, vertices = np.asarray(whole.visual.uv), np.asarray(whole.vertices)
    rng = np.random.default_rng(0)
    corners = vertices[faces]
    areas = np.cumsum(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1))
    face = np.searchsorted(areas, rng.random(BAKED) * areas[-1], side="right")
    weights = rng.dirichlet((1, 1, 1), BAKED)[:, :, None]
    points, at = (corners[face] * weights).sum(axis=1), (uv[faces[face]] * weights).sum(axis=1)
    image = np.zeros((2 * IMAGE, 2 * IMAGE, 3))
    known = np.zeros(image.shape[:2], bool)
    column, row = (at * (1, -1) + (0, 1)).T * 2 * IMAGE
    index = row.astype(int).clip(0, 2 * IMAGE - 1), column.astype(int).clip(0, 2 * IMAGE - 1)
    image[index], known[index] = _solid(points, rng), True
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return _written(folder / "bunny.obj", vertices, faces, uv, Image.fromarray(_bytes(image[tuple(nearest)])))


SHAPES: dict[str, Callable[[Path], Path]] = {"Spot": spot, "Bob": bob, "Bunny": bunny, "Egg": egg, "Earth": earth}
"""Name -> function that writes (or finds) the mesh, with the image beside it, and returns its path; given a folder."""


def _revolved(path: Path, radius: Callable[[Doubles], Doubles], image: Image.Image) -> Path:
    """Write a surface of revolution about y: radius(y) at heights y in [-1, 1]; u runs around it and v upwards."""
    v, u = np.meshgrid(np.arange(ROWS + 1) / ROWS, np.arange(COLUMNS + 1) / COLUMNS, indexing="ij")
    height, angle = -np.cos(np.pi * v), 2 * np.pi * (u - 0.5)
    across = radius(height)
    vertices = np.stack((across * np.sin(angle), height, across * np.cos(angle)), axis=-1).reshape(-1, 3)
    corner = (np.arange(ROWS)[:, None] * (COLUMNS + 1) + np.arange(COLUMNS)).ravel()
    right, up, both = corner + 1, corner + COLUMNS + 1, corner + COLUMNS + 2
    # The poles are rows of one point: one of a square's two triangles has no area there.
    lower, upper = np.stack((corner, right, both), axis=1)[COLUMNS:], np.stack((corner, both, up), axis=1)[:-COLUMNS]
    vertices[(vertices[:, [0, 2]] ** 2).sum(axis=1) < 1e-20] *= (0, 1, 0)
    return _written(path, vertices, np.concatenate((lower, upper)), np.stack((u, v), axis=-1).reshape(-1, 2), image)


def _written(path: Path, vertices: Doubles, faces: NDArray[np.int64], uv: Doubles, image: Image.Image) -> Path:
    """Write an OBJ file and its image by hand: trimesh's writer drops the names that tie the two together."""
    image.save(path.with_suffix(".png"))
    path.with_suffix(".mtl").write_text(f"newmtl skin\nmap_Kd {path.stem}.png\n")
    with path.open("w") as file:
        file.write(f"mtllib {path.stem}.mtl\nusemtl skin\n")
        np.savetxt(file, vertices, "v %.7f %.7f %.7f")
        np.savetxt(file, uv, "vt %.7f %.7f")
        np.savetxt(file, np.repeat(faces + 1, 2, axis=1), "f %d/%d %d/%d %d/%d")
    return path


def _painted(u: Doubles, v: Doubles) -> Doubles:
    """Return the colors of an Easter egg at texture coordinates u, v (H, W): (H, W, 3), sRGB in [0, 1]."""
    color = np.where((v < 0.5)[..., None], (0.96, 0.90, 0.78), (0.62, 0.80, 0.86))
    zigzag = np.abs(v - 0.5 - 0.06 * (np.abs((16 * u) % 2 - 1) - 0.5)) < 0.03
    dots = ((12 * u) % 1 - 0.5) ** 2 + ((v - 0.28) * 10) ** 2 < 0.09
    bands = (np.abs(v - 0.72) < 0.02) | (np.abs(v - 0.8) < 0.01)
    for mask, paint in ((zigzag, (0.80, 0.22, 0.25)), (dots, (0.22, 0.35, 0.62)), (bands, (0.95, 0.75, 0.20))):
        color = np.where(mask[..., None], paint, color)
    return color


def _solid(points: Doubles, rng: np.random.Generator) -> Doubles:
    """Return the colors of stripes around the vertical axis and of spots at random centers, at points (N, 3).

    The result is (N, 3), sRGB in [0, 1].
    """
    x, y, z = points.T
    stripes = np.sin(18 * y + 2 * np.sin(5 * x) + 2 * np.sin(5 * z)) > 0.3
    color = np.where(stripes[:, None], (0.85, 0.62, 0.38), (0.93, 0.87, 0.78))
    centers = points[rng.integers(len(points), size=40)]
    distances = np.min([np.linalg.norm(points - center, axis=1) for center in centers], axis=0)
    return np.where((distances < 0.06)[:, None], (0.30, 0.22, 0.20), color)


def _bytes(color: Doubles) -> NDArray[np.uint8]:
    return np.rint(255 * np.clip(color, 0, 1)).astype(np.uint8)
