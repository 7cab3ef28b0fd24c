"""The Stanford bunny's ten range scans as one oriented point cloud.

    python benchmarks/scans.py stanford_bunny_scans.zip -o scans.npz

A scan is a grid of points as a Cyberware scanner saw them along its z axis; bun.conf says how each one was turned and
moved to fit the others. The points have no normals: these are those of the grid's triangles, averaged.
"""

import argparse
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.trainer.shapes.shape import Doubles, unit

FOLDER = "bunny/data/"
"""Where the scans are in the zip file."""
LONGEST = 4.0
"""Longest edge of a triangle, in medians of all: longer ones bridge from one part of the surface to another behind."""
ROUNDS = 3
"""Times that every point's normal is averaged with those of its triangles' corners, since scans are noisy."""
STEEPEST = 0.2
"""Smallest cosine between a normal and the direction to the scanner: beyond, points are smeared along the view."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A range scan in its scanner's own coordinates."""

    name: str
    points: Doubles
    """(N, 3); the scanner is far away along +z."""
    grid: NDArray[np.int64]
    """(rows, columns): the number of the point there, -1 for none."""
    turn: Doubles
    """(3, 3)"""
    shift: Doubles
    """(3,): a point p is at p @ turn + shift among the other scans."""


def rotation(x: float, y: float, z: float, w: float) -> Doubles:
    """Return the matrix of a unit quaternion with the real part w, which turns a column."""
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def read(path: Path) -> list[Scan]:
    """Read all scans of the zip file."""
    scans = []
    with zipfile.ZipFile(path) as archive:
        for line in archive.read(f"{FOLDER}bun.conf").decode().splitlines():
            words = line.split()
            if not words or words[0] != "bmesh":
                continue
            shift, quaternion = np.array(words[2:5], float), [float(word) for word in words[5:9]]
            points, grid = _ply(archive.read(f"{FOLDER}{words[1]}").decode())
            # The file's quaternion turns the other scans to this one: its matrix times a row is the way back.
            scans.append(Scan(words[1], points, grid, rotation(*quaternion), shift))
    return scans


def _ply(text: str) -> tuple[Doubles, NDArray[np.int64]]:
    """Parse a range scan as a PLY file: its points (N, 3), and the grid of their numbers."""
    lines = text.splitlines()
    end = lines.index("end_header")
    words = {tuple(line.split()[:2]): line.split()[2] for line in lines[:end] if len(line.split()) == 3}
    count = int(words["element", "vertex"])
    lines = lines[end + 1 :]
    points = np.array([line.split() for line in lines[:count]], float)
    cells = [int(line.split()[1]) if line[0] == "1" else -1 for line in lines[count:]]
    shape = int(words["obj_info", "num_rows"]), int(words["obj_info", "num_cols"])
    return points, np.array(cells).reshape(shape)


def oriented(scan: Scan) -> tuple[Doubles, Doubles]:
    """Estimate normals, and place the scan among the others: points (N, 3) and unit normals (N, 3).

    Points without a triangle are left out, and those that the scanner saw at a grazing angle.
    """
    triangles = _triangles(scan)
    corners = scan.points[triangles]
    normals = _gathered(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), triangles, scan)
    for _ in range(ROUNDS):
        normals = _gathered(unit(normals)[triangles].sum(axis=1), triangles, scan)
    normals = unit(normals)
    kept = normals[:, 2] > STEEPEST
    return scan.points[kept] @ scan.turn + scan.shift, normals[kept] @ scan.turn


def _triangles(scan: Scan) -> NDArray[np.int64]:
    """Return the triangles of neighbours in the grid, (F, 3), counterclockwise for the scanner."""
    a, b, c, d = scan.grid[:-1, :-1], scan.grid[:-1, 1:], scan.grid[1:, :-1], scan.grid[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (b, d, c))])
    faces = faces[(faces >= 0).all(axis=1)]
    points = scan.points[faces]
    edges = np.linalg.norm(points - np.roll(points, 1, axis=1), axis=2).max(axis=1)
    near = edges < LONGEST * np.median(edges)
    points, whole = points[near], np.asarray(faces[near], np.int64)
    away = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])[:, 2] < 0
    whole[away] = whole[away, ::-1]
    return whole


def _gathered(values: Doubles, triangles: NDArray[np.int64], scan: Scan) -> Doubles:
    """Sum values (F, 3) of triangles at their corners: (N, 3)."""
    total = np.zeros_like(scan.points)
    for corner in triangles.T:
        np.add.at(total, corner, values)
    return total


def cloud(path: Path) -> tuple[Doubles, Doubles]:
    """Merge all scans of the zip file: points (N, 3), in metres, and unit normals (N, 3)."""
    parts = [oriented(scan) for scan in read(path)]
    return np.concatenate([points for points, _ in parts]), np.concatenate([normals for _, normals in parts])


def main() -> None:
    """Write the cloud to a file that `mplicits train` reads."""
    parser = argparse.ArgumentParser(description="the bunny's range scans as one oriented point cloud")
    parser.add_argument("scans", type=Path, metavar="FILE.zip")
    parser.add_argument("-o", "--output", type=Path, default=Path("scans.npz"))
    options = parser.parse_args()
    points, normals = cloud(options.scans)
    np.savez(options.output, points=points, normals=normals)
    print(f"{options.output}: {len(points):,} points")


if __name__ == "__main__":
    main()
