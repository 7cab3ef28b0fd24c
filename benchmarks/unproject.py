"""How well a depth map becomes a cloud (Appendix G.1): writes docs/results/unproject.md.

    PYTHONPATH=tests python benchmarks/unproject.py [--size 512] [-o docs/results/unproject.md]

pyrender draws depth and colour of a mesh from one side. The depths are taken as they are, with noise of 1 % of the
object's size, rounded to 8 bits, and with round holes, and go through `mplicits unproject`. Errors are distances of the
cloud's points to the mesh, in shares of its size (the diameter of its bounding sphere).
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray

from mplicits.capture.intrinsics import of_view
from mplicits.capture.unproject import step_share, unproject
from mplicits.trainer.shapes.shape import normalise
from mplicits.viewer.draw.camera import Camera
from protocol import DATA, Page, machine
from support.rasterised import Rasterised

Doubles = NDArray[np.float64]

SHAPES = {"Spot": ("textured/spot.obj", Camera(20, 15)), "Armadillo": ("meshes/armadillo.ply", Camera(200, 15))}
"""Name -> file and camera."""
SIZE = 2.0
"""Of an object in model space."""
HEAD = """# From a depth map to a cloud

Distances of `mplicits unproject`'s points to the mesh whose depth map it was given, in percent of the object's size,
and angles between normals and the mesh's faces. Depth and colour are pyrender's, {size} x {size} pixels; noise:
Gaussian, 1 % of the object's size at each pixel; 8 bits: 255 steps from the nearest to the farthest; holes: 60 discs
without depth.

`PYTHONPATH=tests python benchmarks/unproject.py` on {machine}.

| shape | depths | points, of pixels | mean | 95 % | largest | normals, median | 95 % |
|---|---|---:|---:|---:|---:|---:|---:|"""


def rounded(depth: Doubles, _: np.random.Generator) -> Doubles:
    """Round to 255 steps."""
    near, far = np.nanmin(depth), np.nanmax(depth)
    return np.asarray(near + (far - near) * np.round((depth - near) / (far - near) * 254) / 254)


def noisy(depth: Doubles, rng: np.random.Generator) -> Doubles:
    """Add noise of 1 % of the object's size."""
    return np.asarray(depth + rng.normal(0, 0.01 * SIZE, depth.shape))


def holed(depth: Doubles, rng: np.random.Generator) -> Doubles:
    """Cut 60 discs out of the picture."""
    result = depth.copy()
    rows, columns = np.indices(depth.shape)
    for y, x, radius in rng.random((60, 3)) * (*depth.shape, len(depth) / 40):
        result[(rows - y) ** 2 + (columns - x) ** 2 < radius**2] = np.nan
    return result


WORSENED: dict[str, Callable[[Doubles, np.random.Generator], Doubles]] = {
    "clean": lambda depth, _: depth,
    "1 % noise": noisy,
    "8 bits": rounded,
    "holes": holed,
}


def row(name: str, label: str, mesh: trimesh.Trimesh, depth: Doubles, camera: Camera) -> str:
    """Unproject one depth map and compare it with the mesh, in model space: a row of the table."""
    intrinsics = of_view(camera.fov, *depth.shape)
    step = step_share(depth, depth, inverse=False)
    cloud = unproject(depth, intrinsics, None, step)[0]
    matrix = camera.matrix().astype(np.float64)
    points = cloud.points @ matrix[:3, :3].T + matrix[:3, 3]
    square, face, _ = igl.point_mesh_squared_distance(points, mesh.vertices, np.asarray(mesh.faces, np.int64))[:3]
    error = 100 * np.sqrt(square) / SIZE
    cosine = (mesh.face_normals[face] * (cloud.normals @ matrix[:3, :3].T)).sum(axis=1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    share = len(points) / np.isfinite(depth).sum()
    errors = f"{error.mean():.3f} % | {np.percentile(error, 95):.3f} % | {error.max():.2f} %"
    return f"| {name} | {label} | {share:.1%} | {errors} | {np.median(angle):.1f} | {np.percentile(angle, 95):.1f} |"


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=512, help="pixels a side")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/unproject.md"))
    args = parser.parse_args()
    page = Page(args.output, HEAD.format(size=args.size, machine=machine()))
    for name, (file, camera) in SHAPES.items():
        mesh = trimesh.load_mesh(DATA / file, process=False)
        vertices, centre, scale = normalise(np.asarray(mesh.vertices, np.float64))
        drawn = Rasterised(mesh, centre, scale, (args.size, args.size))
        depth = drawn(camera)[1]
        drawn.release()
        moved = trimesh.Trimesh(vertices, mesh.faces, process=False)
        seen = np.where(depth > 0, depth, np.nan)
        for label, worsen in WORSENED.items():
            page.add(row(name, label, moved, worsen(seen, np.random.default_rng(0)), camera))


if __name__ == "__main__":
    main()
