"""The measuring code of benchmarks/peers.py, on spheres."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from mplicits.readers.content import Mesh
from mplicits.trainer.shapes.mesh import MeshShape
from peers_meshes import Triangles, draco, meshopt
from peers_rows import DRACO, PACKED, Row, bytes_for, fitting, losses, table, verdict
from peers_surface import Paint, Surface, Truth
from peers_volumes import texture
from support import needs

SAMPLES = 20_000


def ball(radius: float = 1.0, paint: Paint | None = None, flat: bool = False, above: float = -2.0) -> Surface:
    """Make a sphere with its exact normals, or those of its faces; of its part where z > above."""
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=radius)
    faces = mesh.faces[mesh.triangles_center[:, 2] > above]
    normals = (mesh.vertices / radius)[faces]
    if flat:
        normals = np.repeat(mesh.face_normals[mesh.triangles_center[:, 2] > above][:, None], 3, axis=1)
    return Surface(np.asarray(mesh.vertices), np.asarray(faces, np.int64), np.asarray(normals), paint)


def painted(red: float) -> Paint:
    """Return a paint of one color."""
    return lambda points, _faces, _weights: np.tile([red, 0.5, 0.5], (len(points), 1))


def test_distance_and_colors_of_concentric_spheres() -> None:
    truth = Truth(ball(paint=painted(0.5)), SAMPLES)
    found = truth.errors(ball(1.05, painted(0.8)))
    assert found.distance == pytest.approx(0.05, rel=0.01)
    assert found.angle < 0.1
    assert found.color == pytest.approx(255 * np.sqrt(0.3**2 / 3))
    assert truth.errors(ball()).color is None


def test_both_directions_count() -> None:
    """A missing half costs the mean distance of its points to the rim, in one of the two directions."""
    depth = np.linspace(0, np.pi / 2, 10_001)
    to_rim = np.trapezoid(2 * np.sin(depth / 2) * np.cos(depth), depth)  # mean over the half, by area
    whole, half = ball(), ball(above=0.0)
    for one, other in ((whole, half), (half, whole)):
        assert Truth(one, SAMPLES).errors(other).distance == pytest.approx(to_rim / 4, rel=0.03)


def test_angle_of_flat_faces() -> None:
    """The normals of the faces are as far from the sphere's as random points of a face are from its center."""
    mesh = trimesh.creation.icosphere(subdivisions=5)
    points, face = trimesh.sample.sample_surface(mesh, SAMPLES, seed=1)
    cosine = (points / np.linalg.norm(points, axis=1)[:, None] * mesh.face_normals[face]).sum(axis=1)
    expected = np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()
    assert Truth(ball(), SAMPLES).errors(ball(flat=True)).angle == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("coder", ["draco", "meshopt"])
def test_coded_meshes(coder: str) -> None:
    needs.package("DracoPy" if coder == "draco" else "meshoptimizer")
    code = draco if coder == "draco" else meshopt
    sphere = trimesh.creation.icosphere(subdivisions=4)
    faces = np.asarray(sphere.faces, np.int64)
    uv = np.asarray(sphere.vertices)[faces][:, :, :2]
    mesh = Triangles(np.asarray(sphere.vertices), faces, uv)
    truth = Truth(mesh.surface(), SAMPLES)
    coarse, fine = (code(mesh, bits) for bits in (8, 13))
    assert coarse.size < fine.size < 12 * len(faces)
    assert truth.errors(fine.decoded.surface()).distance < 1e-3 < truth.errors(coarse.decoded.surface()).distance
    stored = code(replace(mesh, uv=None), 13, ball())
    assert stored.decoded.normals is not None
    assert stored.decoded.uv is None
    at_corners = stored.decoded.vertices[stored.decoded.faces]
    assert np.abs(stored.decoded.normals - at_corners).max() < 0.03
    assert fine.decoded.uv is not None
    assert np.abs(fine.decoded.uv - fine.decoded.vertices[fine.decoded.faces][:, :, :2]).max() < 2e-3


def test_texture_of_distances() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4)
    shape = MeshShape(Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64)), "ball", {})
    truth = Truth(ball(), SAMPLES)
    found = texture(shape, truth.surface.sample(SAMPLES, np.random.default_rng(2)), 32)
    texels = found.texels
    assert (int(texels[16, 16, 16]), int(texels[0, 0, 0])) == (0, 255)
    errors = truth.errors(found.surface())
    assert errors.distance < found.side / 20
    assert errors.angle < 2


def rows(method: str, scale: float) -> list[Row]:
    """Return files whose distance falls with the square of their bytes, and whose angle falls with these."""
    sizes = (1000, 4000, 16_000)
    return [Row(method, f"{size}", size, scale * 1e4 / size**2, 1e4 / size, None) for size in sizes]


def test_bytes_at_equal_errors() -> None:
    theirs = rows(DRACO, 1.0)
    assert fitting(theirs, 1e4 / 9000**2, "distance") == pytest.approx(9000)
    assert fitting(theirs, 1e4 / 20_000, "angle") == np.inf
    assert fitting(theirs, 1e4, "distance") == pytest.approx(1000)
    mine = Row(PACKED, "base", 10_000, 1e4 / 9000**2, 1e4 / 12_000, None)
    assert bytes_for(theirs, mine) == pytest.approx(12_000)
    (line,) = verdict("ball", [mine, *theirs])
    assert "base: holds" in line
    assert "9,000 for the distance, 12,000 for the normals" in line
    assert not losses("ball", [mine, *rows("meshopt", 1.0)])[0].startswith("- ball, base")
    larger = replace(mine, size=13_000)
    assert "does not hold" in verdict("ball", [larger, *theirs])[0]
    assert f"{DRACO} 12,000" in losses("ball", [larger, *theirs])[0]


def test_table_leaves_out_beaten_rows() -> None:
    worse = Row(DRACO, "worse", 5000, 1.0, 20.0, None)
    lines = table([*rows(DRACO, 1.0), worse])
    assert [line.split("|")[2].strip() for line in lines[2:]] == ["1000", "4000", "16000"]
    assert {line.count("|") for line in lines} == {6}, "no shape has colors"
    assert {line.count("|") for line in table([replace(worse, color=3.0), worse])} == {7}
