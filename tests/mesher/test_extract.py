"""Marching cubes with culling, compared with dense evaluation, with formulas, and with what trimesh says."""

from dataclasses import dataclass

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from mplicits.mesher.cull import culled, dense
from mplicits.mesher.extract import extract
from mplicits.mesher.grid import EXTENT, Grid
from mplicits.mesher.model_field import Field
from mplicits.mesher.parallel import Silent
from mplicits.mesher.surface import Mesh

Array = NDArray[np.float32]


@dataclass
class Ellipsoid:
    """An ellipsoid whose axes differ and whose center is not the origin, so that no two directions can be confused."""

    axes: tuple[float, float, float] = (0.9, 0.5, 0.3)
    center: tuple[float, float, float] = (0.03, -0.2, 0.1)
    chunk: int = 1000

    def value(self, points: Array) -> Array:
        return np.asarray(np.linalg.norm((points - self.center) / self.axes, axis=1) - 1, np.float32)

    def clearance(self, points: Array) -> Array:
        return np.asarray(np.abs(self.value(points)) * min(self.axes), np.float32)


class Waves:
    """A surface that fills the cube, with every configuration of signs, and goes on through the cube's faces."""

    chunk = 1000

    def value(self, points: Array) -> Array:
        x, y, z = 17 * points.T
        noise = np.sin(7919 * np.round(points * 1e4).astype(np.float64) @ (1.0, 2.3, 5.7))
        return np.asarray(np.sin(x) * np.cos(1.3 * y) + np.sin(y) * np.cos(z) + 0.8 * noise, np.float32)

    def clearance(self, points: Array) -> Array:
        return np.zeros(len(points), np.float32)


class Misled(Ellipsoid):
    """An ellipsoid whose clearance is right near one end of the surface and too large everywhere else."""

    def clearance(self, points: Array) -> Array:
        right = super().clearance(points)
        return np.where(points[:, 0] > 0.7, right, right + 0.05).astype(np.float32)


def checked(mesh: Mesh) -> trimesh.Trimesh:
    """Check that a mesh is closed, oriented outwards, and without doubles; return it as trimesh's."""
    seen = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert seen.is_watertight
    assert seen.is_winding_consistent
    assert seen.volume > 0
    assert len(np.unique(mesh.vertices, axis=0)) == len(mesh.vertices)
    assert seen.area_faces.min() > 0
    return seen


@pytest.mark.parametrize("resolution", [8, 31, 64, 97])
def test_the_mesh_is_the_ellipsoid(resolution: int) -> None:
    field = Ellipsoid()
    seen = checked(extract(field, resolution))
    side = Grid(resolution).side
    assert np.abs(field.value(seen.vertices.astype(np.float32))).max() < 3 * side**2 / min(field.axes) ** 2
    if resolution > 60:
        assert seen.volume == pytest.approx(4 / 3 * np.pi * np.prod(field.axes), rel=2e-2)
        np.testing.assert_allclose(seen.bounds.mean(axis=0), field.center, atol=side)


@pytest.mark.parametrize("field", [Ellipsoid(), Waves(), Misled()])
@pytest.mark.parametrize("resolution", [24, 33])
def test_culling_finds_the_cells_of_dense_evaluation(field: Field, resolution: int) -> None:
    grid = Grid(resolution)
    fast, slow = culled(field, grid, Silent()), dense(field, grid, Silent())
    for name in ("cells", "corners", "keys", "values"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name))
    assert len(fast.cells) > 100


@pytest.mark.parametrize("resolution", [16, 33])
def test_ambiguous_cells_and_the_cube_s_faces_are_closed(resolution: int) -> None:
    mesh = extract(Waves(), resolution)
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert not (count % 2).any()
    assert np.abs(mesh.vertices).max() <= EXTENT
    assert len(np.unique(mesh.vertices, axis=0)) == len(mesh.vertices)


def test_a_surface_through_vertices_has_no_flat_triangles() -> None:
    class Box:
        chunk = 1000

        def value(self, points: Array) -> Array:
            return np.asarray(np.abs(points).max(axis=1) - np.float32(EXTENT / 2), np.float32)

        def clearance(self, points: Array) -> Array:
            return np.asarray(np.abs(self.value(points)) / np.sqrt(3), np.float32)

    checked(extract(Box(), 16))


def test_most_of_the_grid_is_left_out() -> None:
    asked = 0

    class Counting(Ellipsoid):
        def value(self, points: Array) -> Array:
            nonlocal asked
            asked += len(points)
            return super().value(points)

    mesh = extract(Counting(), 96)
    assert asked < 12 * len(mesh.vertices) < 97**3 / 2


def test_a_field_without_a_surface_gives_an_empty_mesh() -> None:
    mesh = extract(Ellipsoid(axes=(1e-6, 1e-6, 1e-6)), 16)
    assert (len(mesh.vertices), len(mesh.faces), mesh.components()[0]) == (0, 0, 0)
