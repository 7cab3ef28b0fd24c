"""Mesh files as triangles in model space: vertices, normals, and errors."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits.model.errors import UserError
from mplicits.viewer.draw.triangles import Triangles, read_triangles

ORIGIN = (0.0, 0.0, 0.0)
PLY = (
    "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
)


@pytest.fixture
def ball() -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=2)
    return mesh


def outwards(triangles: Triangles) -> float:
    """Return the least cosine between a vertex's normal and the direction from the center."""
    normals = triangles.normals / np.linalg.norm(triangles.normals, axis=1)[:, None]
    radii = np.linalg.norm(triangles.vertices, axis=1)
    return float((normals * triangles.vertices).sum(axis=1).min() / radii.max())


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb"])
def test_vertices_are_in_model_space_and_normals_point_outward(
    suffix: str, tmp_path: Path, ball: trimesh.Trimesh
) -> None:
    center, scale = (10.0, -20.0, 5.0), 3.0
    ball.vertices = ball.vertices * scale + center
    ball.export(tmp_path / f"ball{suffix}")
    triangles = read_triangles(tmp_path / f"ball{suffix}", center, scale)
    arrays = (triangles.vertices, triangles.normals, triangles.faces)
    assert [str(array.dtype) for array in arrays] == ["float32", "float32", "int32"]
    np.testing.assert_allclose(np.linalg.norm(triangles.vertices, axis=1), 1, atol=1e-5)
    assert len(triangles.faces) == len(ball.faces)
    assert outwards(triangles) > 0.99, "smooth, also from an STL, whose triangles share no vertices"


def test_an_inside_out_mesh_is_flipped(tmp_path: Path, ball: trimesh.Trimesh) -> None:
    trimesh.Trimesh(ball.vertices, ball.faces[:, ::-1], process=False).export(tmp_path / "ball.obj")
    assert outwards(read_triangles(tmp_path / "ball.obj", ORIGIN, 1.0)) > 0.99


def test_normals_in_the_file_are_kept(tmp_path: Path, ball: trimesh.Trimesh) -> None:
    tilted = np.asarray(ball.vertices) + np.array((0.3, 0.0, 0.0))
    tilted /= np.linalg.norm(tilted, axis=1)[:, None]
    written = trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=tilted, process=False)
    written.export(tmp_path / "ball.ply", vertex_normal=True)
    np.testing.assert_allclose(read_triangles(tmp_path / "ball.ply", ORIGIN, 1.0).normals, tilted, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("m.ply", None, "no such file"),
        ("m.png", "", "not a mesh by its suffix"),
        ("m.ply", "nonsense", "not a readable PLY file"),
        ("m.obj", "v 0 0 0\n", "no triangles"),
        ("m.ply", PLY.format(3, 1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "m.ply"),
        ("m.ply", PLY.format(3, 1) + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", "not finite"),
        ("m.ply", PLY.format(3, 1) + "900 0 0\n901 0 0\n900 1 0\n3 0 1 2\n", "--space model"),
        ("m.ply", PLY.format(3, 1) + "0 0 0\n.001 0 0\n0 .001 0\n3 0 1 2\n", "--space model"),
    ],
)
def test_a_bad_mesh_is_one_line(name: str, content: str | None, said: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(UserError) as raised:
        read_triangles(tmp_path / name, ORIGIN, 1.0)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)
