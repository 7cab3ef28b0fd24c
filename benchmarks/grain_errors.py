"""Errors of a trained field's normals by wavelength, on flats and at creases, for benchmarks/grain.py."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from grain_shapes import SHARP, SOLIDS
from mplicits.field.interpret import field_gradient
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA

Doubles = NDArray[np.float64]
FILES = {name: f"meshes/{name}.ply" for name in ("bunny", "armadillo")}
FILES |= {name: f"thingi32/{name}.ply" for name in ("72960", "44234")} | {"spot": "textured/spot.obj"}
POINTS, ASKED = 200_000, 10_000
"""Points of the surface, and those of them around which means are taken."""
RADII = (0.02, 0.04, 0.08)
"""Radii of the local means, in radii of the shape; the first one's removes all but the grain."""
SPACED = (1, 1, 4)
"""Each mean takes every n-th point."""
WAVES = 2.85
"""Wavelength that a mean over a disk halves, in radii of the disk: 2 J1(x) / x = 1/2 at x = 2.2."""
NEAR, FAR = 0.015, 0.03
"""Points at a crease are nearer to it than NEAR; points of flats are farther from all than FAR."""
ALONG = 0.002
"""Distance between points of a crease."""


class Truth:
    """A shape, points of its surface with true normals, and its creases."""

    def __init__(self, name: str, folder: Path) -> None:
        """name: of a solid, or of a file. folder: for the files of solids."""
        solid = SOLIDS[name]() if name in SOLIDS else None
        self.path = DATA / FILES[name] if solid is None else folder / f"{name}.ply"
        if solid is not None:
            solid.mesh.export(self.path)
        self.shape: Shape = load_shape(str(self.path), crease=CREASE)[0]
        drawn = self.shape.surface(POINTS, np.random.default_rng(1))
        self.points, self.normals = drawn.points, drawn.normals
        if solid is not None and solid.exact is not None:
            self.normals = solid.exact(drawn.points * self.shape.scale + self.shape.center)
        bend = np.linalg.norm(bands(self.points, self.normals, self.normals)[0], axis=1)
        self.smooth = bend <= np.median(bend)
        """The half (ASKED,) of the points around which means are taken where the normals differ least from theirs."""
        self.clear: Doubles | None = self._from_creases(solid.mesh) if solid and name in SHARP else None
        """Distance (POINTS,) of the points to the nearest crease; None for a smooth shape."""
        if self.clear is not None:
            self.smooth &= self.clear[_asked(self.points)] > FAR

    def _from_creases(self, mesh: trimesh.Trimesh) -> Doubles:
        sharp = mesh.face_adjacency_edges[np.degrees(mesh.face_adjacency_angles) > CREASE]
        ends = (mesh.vertices[sharp] - self.shape.center) / self.shape.scale
        places = []
        for start, end in ends:
            count = int(np.linalg.norm(end - start) / ALONG) + 2
            places.append(start + np.linspace(0, 1, count)[:, None] * (end - start))
        return np.asarray(cKDTree(np.concatenate(places)).query(self.points)[0])


@dataclass(frozen=True)
class Errors:
    """Errors of a field on a surface; angles in degrees."""

    value: float
    """Mean |f|."""
    distance: float
    """Mean |f| / |grad f|."""
    angle: float
    """Mean angle between grad f and the true normals."""
    grain: float
    """Root mean square of the normals' error without its mean over RADII[0]."""
    bands: tuple[float, ...]
    """Root mean square of the normals' error by wavelength, from short to long, where the shape is smooth."""
    flats: float | None
    """Mean angle far from creases."""
    creases: float | None
    """Mean angle at creases."""

    def cells(self) -> str:
        """Return the cells of the table."""
        bands = " | ".join(f"{band:.2f}" for band in self.bands)
        sharp = " | ".join("" if angle is None else f"{angle:.2f}" for angle in (self.flats, self.creases))
        return f"{self.value:.2e} | {self.distance:.2e} | {self.angle:.2f} | {self.grain:.2f} | {bands} | {sharp}"


def measure(model: Model, truth: Truth) -> Errors:
    """Measure a model's field on the surface of its shape."""
    program, points = lower(model), truth.points.astype(np.float32)
    parts = [field_gradient(program, part, len(model.levels)) for part in np.array_split(points, 20)]
    gradient, f = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    length = np.maximum(np.linalg.norm(gradient, axis=1), 1e-6)
    error = gradient / length[:, None] - truth.normals
    angle = np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(error, axis=1) / 2, 0, 1)))
    clear, grain = truth.clear, bands(truth.points, truth.normals, error)
    return Errors(
        value=float(np.abs(f).mean()),
        distance=float((np.abs(f) / length).mean()),
        angle=float(angle.mean()),
        grain=_root_mean_square(grain[0]),
        bands=tuple(_root_mean_square(band[truth.smooth]) for band in grain),
        flats=None if clear is None else float(angle[clear > FAR].mean()),
        creases=None if clear is None else float(angle[clear < NEAR].mean()),
    )


def bands(points: Doubles, normals: Doubles, error: Doubles) -> list[Doubles]:
    """Split the error of normals by wavelength: the differences of its means over ever larger disks of the surface.

    points, normals, error: (N, 3); error: difference of unit vectors. Returns a part (ASKED, 3) of each band: what the
    mean over RADII[0] takes away, the differences of the means, and the last mean.
    """
    asked = _asked(points)
    means = [error[asked]]
    for radius, spaced in zip(RADII, SPACED, strict=True):
        means.append(
            local_mean(points[::spaced], normals[::spaced], error[::spaced], radius, points[asked], normals[asked])
        )
    return [means[i] - means[i + 1] for i in range(len(RADII))] + [means[-1]]


def local_mean(
    points: Doubles, normals: Doubles, values: Doubles, radius: float, at: Doubles, facing: Doubles
) -> Doubles:
    """Average values (N, 3) over the points (N, 3) nearer than `radius` to places `at` (M, 3), on the same side.

    normals: (N, 3). facing: (M, 3), normals at the places. Points whose normals differ by more than 60 degrees do not
    count: they are beyond a crease, or on a thin part's other side.
    """
    pairs = cKDTree(at).sparse_distance_matrix(cKDTree(points), radius, output_type="coo_matrix")
    row, column = pairs.row, pairs.col
    same = np.einsum("ij,ij->i", facing[row], normals[column]) > 0.5
    row, column = row[same], column[same]
    count = np.bincount(row, minlength=len(at))
    sums = np.stack([np.bincount(row, values[column, axis], len(at)) for axis in range(3)], axis=1)
    return np.asarray(sums / np.maximum(count, 1)[:, None])


def _asked(points: Doubles) -> NDArray[np.int64]:
    """Choose the points of (N, 3) around which means are taken."""
    return np.random.default_rng(0).choice(len(points), ASKED, replace=False)


def _root_mean_square(vectors: Doubles) -> float:
    """Return the root mean square length of short vectors (N, 3) as an angle, degrees."""
    return float(np.degrees(np.sqrt(np.square(vectors).sum(axis=1).mean())))
