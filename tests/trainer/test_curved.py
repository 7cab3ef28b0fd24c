"""Curved surfaces of meshes against the sphere, the cube and the cylinder that the meshes sample."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from mplicits.readers.values import CornerValues
from mplicits.trainer.shapes.creases import closed, corner_normals, usable_normals
from mplicits.trainer.shapes.curved import Facets, curved, flat
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh import MeshShape
from support import needs
from support.paths import DATA

SIDES = 24
SPOT = DATA / "textured" / "spot.obj"


def facets_of(mesh: trimesh.Trimesh, crease: float = 30.0) -> Facets:
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    return curved(vertices, faces, corner_normals(vertices, faces, crease))


def cylinder(sides: int) -> trimesh.Trimesh:
    """A cylinder of radius 1 and height 2 around z."""
    mesh: trimesh.Trimesh = trimesh.creation.cylinder(1.0, 2.0, sections=sides)
    mesh.merge_vertices()
    return mesh


def angles(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.degrees(np.arccos(np.clip(np.einsum("...i,...i->...", one, other), -1, 1))))


def test_an_icosphere_becomes_a_sphere() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    facets = facets_of(mesh)
    corners = facets.vertices[facets.faces]
    centers = corners.mean(axis=1)
    flat_error = 1 - np.linalg.norm(mesh.triangles_center, axis=1).min()
    assert np.abs(np.linalg.norm(centers, axis=1) - 1).max() < flat_error / 8
    assert angles(facets.normals[:], corners / np.linalg.norm(corners, axis=2, keepdims=True)).max() < 1.0


@pytest.mark.parametrize(
    ("mesh", "length"),
    [
        (trimesh.creation.box((1, 2, 3)), 4 * (1 + 2 + 3) / (np.sqrt(14) / 2)),
        (trimesh.creation.cylinder(1.0, 2.0, sections=96), 4 * np.pi / np.sqrt(2)),
        (trimesh.creation.icosphere(subdivisions=3), 0),
    ],
    ids=["box", "cylinder", "ball"],
)
def test_the_line_gives_the_length_of_sharp_edges(mesh: trimesh.Trimesh, length: float) -> None:
    shape, _ = load_shape(mesh, crease=30.0)
    assert shape.taken is not None
    assert shape.taken.creases == pytest.approx(length, rel=2e-3)
    assert (f"{length:.2g} radii of sharp edges" in shape.taken.line()) == (length > 0)
    as_flat, _ = load_shape(mesh, crease=None)
    assert as_flat.taken is not None
    assert "sharp" not in as_flat.taken.line()


def test_a_cube_stays_a_cube() -> None:
    mesh = trimesh.creation.box((2.0, 2.0, 2.0))
    facets = facets_of(mesh)
    assert np.abs(np.abs(facets.vertices).max(axis=1) - 1).max() < 1e-12
    assert np.abs(facets.normals[:] - mesh.face_normals[facets.parents][:, None]).max() < 1e-12


def test_a_cylinder_is_round_between_sharp_rims() -> None:
    facets = facets_of(cylinder(SIDES))
    corners = facets.vertices[facets.faces]
    centers = corners.mean(axis=1)
    is_cap = np.abs(facets.normals[:][:, 0, 2]) > 0.5
    assert np.abs(np.abs(corners[is_cap][:, :, 2]) - 1).max() < 1e-12, "caps are flat"
    sagitta = 1 - np.cos(np.pi / SIDES)
    assert np.abs(np.linalg.norm(centers[~is_cap][:, :2], axis=1) - 1).max() < sagitta / 5
    radial = corners[~is_cap] * (1, 1, 0)
    assert angles(facets.normals[:][~is_cap], radial / np.linalg.norm(radial, axis=2, keepdims=True)).max() < 1.0
    rim = np.abs(np.linalg.norm(corners[is_cap][:, :, :2], axis=2) - 1) < sagitta / 5
    assert rim.any(axis=1).sum() >= 2 * 5 * SIDES - 2, "the caps are as round as the barrel"


@pytest.mark.parametrize(("sides", "round_barrel"), [(5, False), (9, True)])
def test_a_coarse_cylinder_is_round_and_a_prism_has_creases(sides: int, round_barrel: bool) -> None:
    """With nine sides, edges bend by 40 degrees, like their neighbors; with five, by 72 degrees."""
    facets = facets_of(cylinder(sides))
    barrel = facets.vertices[facets.faces[np.abs(facets.normals[:][:, 0, 2]) < 0.5]].mean(axis=1)
    inner = np.linalg.norm(barrel[:, :2], axis=1).min()
    assert (inner > (1 + np.cos(np.pi / sides)) / 2) == round_barrel


def test_one_bent_edge_in_a_flat_sheet_is_a_crease_above_its_angle() -> None:
    """A roof of two flat halves, eight strips each, that bends by 40 degrees only along the ridge."""
    x, y = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 9), indexing="ij")
    vertices = np.stack((x, y, -np.tan(np.radians(20)) * np.abs(x)), axis=-1).reshape(-1, 3)
    corner = (np.arange(16)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        (np.stack((corner, corner + 9, corner + 1), axis=1), np.stack((corner + 1, corner + 9, corner + 10), axis=1))
    )
    sharp = curved(vertices, faces, corner_normals(vertices, faces, 30.0))
    assert np.abs(sharp.vertices[:, 2] + np.tan(np.radians(20)) * np.abs(sharp.vertices[:, 0])).max() < 1e-12
    smooth = corner_normals(vertices, faces, 50.0)
    assert angles(smooth[:], np.array([0.0, 0.0, 1.0])).min() < 1.0, "the ridge is round"


@pytest.mark.parametrize("kind", ["icosphere", "cylinder", "annulus"])
def test_no_gap_opens(kind: str) -> None:
    sizes = {"icosphere": (1,), "cylinder": (1.0, 2.0), "annulus": (0.5, 1.0, 1.0)}
    mesh = getattr(trimesh.creation, kind)(*sizes[kind])
    mesh.merge_vertices()
    facets = facets_of(mesh)
    assert trimesh.Trimesh(np.round(facets.vertices, 9), facets.faces, process=True).is_watertight


@needs.data(SPOT)
def test_spot_is_smooth_and_closed() -> None:
    mesh = trimesh.load_mesh(SPOT, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    facets = facets_of(mesh)
    assert trimesh.Trimesh(np.round(facets.vertices, 9), facets.faces, process=True).is_watertight
    flat_normals = trimesh.Trimesh(facets.vertices, facets.faces, process=False).face_normals
    middle = facets.normals[:].mean(axis=1)
    away = angles(middle / np.linalg.norm(middle, axis=1, keepdims=True), flat_normals)
    assert away.mean() < 1, "the curved surface has its own normals; interpolated normals are 2.3 degrees off"
    assert (away < 15).mean() > 0.99


def test_normals_of_a_file_are_used_where_they_fit_the_faces() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=1)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    numbers = np.arange(faces.size).reshape(-1, 3)
    computed = CornerValues(np.zeros((faces.size, 3)), numbers)
    stored = 2.0 * vertices[faces]
    stored[0] *= -1
    stored[1] = np.nan
    stored[2] = 0
    used = usable_normals(vertices, faces, CornerValues(stored.reshape(-1, 3), numbers), computed)[:]
    np.testing.assert_array_equal(used[:3], 0)
    np.testing.assert_allclose(used[3:], vertices[faces][3:])


def test_a_fine_mesh_is_not_subdivided() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=6)
    facets = facets_of(mesh)
    assert len(facets.faces) == len(mesh.faces)
    np.testing.assert_allclose(facets.vertices[facets.faces], mesh.triangles)


def test_a_mesh_is_closed_where_every_edge_has_two_faces() -> None:
    faces = np.asarray(trimesh.creation.icosphere(subdivisions=1).faces)
    assert closed(faces)
    assert not closed(faces[1:])
    assert not closed(np.concatenate((faces, faces[:1])))
    assert not closed(np.concatenate((faces, faces[:2])))


def test_normals_that_cancel_around_a_vertex_become_face_normals() -> None:
    """Two squares back to back that share their corners and a diagonal."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])
    normals = corner_normals(vertices, faces, 180.0)[:]
    np.testing.assert_allclose(normals, np.repeat([[[0, 0, 1.0]]] * 2 + [[[0, 0, -1.0]]] * 2, 3, axis=1), atol=1e-12)


def test_a_flat_mesh_has_the_faces_normals() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=1)
    facets = flat(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    np.testing.assert_allclose(facets.normals[:], np.repeat(mesh.face_normals[:, None], 3, axis=1), atol=1e-12)


def test_a_curved_shape_fills_the_unit_sphere(tmp_path: Path) -> None:
    """An icosphere of 80 inward faces, far from the origin."""
    mesh = trimesh.creation.icosphere(subdivisions=1)
    mesh.apply_scale(3.0)
    mesh.apply_translation((5.0, -7.0, 9.0))
    mesh.invert()
    mesh.export(tmp_path / "ball.ply")
    shape, warnings = load_shape(str(tmp_path / "ball.ply"), crease=30.0)
    assert isinstance(shape, MeshShape)
    assert len(warnings) == 1
    assert shape.source["crease"] == 30.0
    np.testing.assert_allclose(shape.center, (5, -7, 9), atol=0.02)
    drawn = shape.surface(2000, np.random.default_rng(0))
    assert np.linalg.norm(drawn.points, axis=1).max() <= 1 + 1e-9
    assert np.abs(np.linalg.norm(drawn.points * shape.scale, axis=1) - 3).max() < 0.03
    assert np.einsum("ij,ij->i", drawn.points, drawn.normals).min() > 0.99
    points = np.random.default_rng(1).uniform(-1, 1, (1000, 3))
    assert (
        np.abs(shape.distance(points) * shape.scale - (np.linalg.norm(points * shape.scale, axis=1) - 3)).max() < 0.03
    )
    assert "crease" not in load_shape(str(tmp_path / "ball.ply"))[0].source
