"""Mesh files as they come: in every format, of loose triangles, damaged, or of another shape."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.compare import compare
from mplicits.mesher.read_meshes import in_model_space, normalization, read_mesh
from mplicits.model.errors import UserError

BALL = trimesh.creation.icosphere(subdivisions=3)
HEAD = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb", ".STL"])
@pytest.mark.parametrize("size", [1e-7, 1.0, 1e7])
def test_every_format_and_size_gives_the_same_surface(suffix: str, size: float, tmp_path: Path) -> None:
    path = tmp_path / f"ball{suffix}"
    written = trimesh.Trimesh(BALL.vertices * size, BALL.faces, process=False)
    if suffix == ".obj":  # with decimals enough
        text = trimesh.exchange.obj.export_obj(written, digits=16)  # type: ignore[no-untyped-call]
        path.write_text(str(text), encoding="utf-8")
    else:
        written.export(path, file_type=suffix[1:].lower())
    read = read_mesh(path)
    mesh = in_model_space(read, *normalization(read))
    assert (len(mesh.vertices), len(mesh.faces), mesh.components()[0]) == (642, 1280, 1)
    figures = compare(mesh, mesh, 100)
    assert figures.watertight
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(1, abs=1e-5)


def test_loose_triangles_become_one_surface(tmp_path: Path) -> None:
    """Vertices at one place are joined, and triangles that are a point or a line then do not open the surface."""
    box = trimesh.creation.box()
    corners = np.concatenate((box.triangles.reshape(-1, 3), [[np.nan, 9, 9]]))
    faces = [*np.arange(36).reshape(-1, 3), (0, 0, 1), (0, 0, 0)]
    trimesh.Trimesh(corners, faces, process=False).export(tmp_path / "soup.ply")
    mesh = in_model_space(read_mesh(tmp_path / "soup.ply"), (0.0, 0.0, 0.0), 2.0)
    assert (len(mesh.vertices), len(mesh.faces), mesh.components()[0]) == (8, 12, 1)
    assert np.abs(mesh.vertices).max() == 0.25
    assert compare(mesh, mesh, 100).watertight


def test_a_mesh_that_is_inside_out_is_turned(tmp_path: Path) -> None:
    trimesh.Trimesh(BALL.vertices, BALL.faces[:, ::-1], process=False).export(tmp_path / "turned.ply")
    space = (0.0, 0.0, 0.0), 1.0
    assert (
        compare(
            in_model_space(read_mesh(tmp_path / "turned.ply"), *space), in_model_space(BALL, *space), 500
        ).normal_angle
        < 1e-3
    )


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("index.ply", HEAD + "3 0 1 7\n", "triangles refer to missing vertices"),
        ("negative.ply", HEAD + "3 0 1 -1\n", "triangles refer to missing vertices"),
        ("huge.obj", "v 0 0 1e200\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("infinite.obj", "v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "zero area"),
        ("empty.obj", "", "empty.obj"),
        ("point.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "zero area"),
        ("points.ply", HEAD.replace("face 1", "face 0"), "no triangles"),
    ],
)
def test_damage_is_refused_with_one_line(name: str, text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=said) as caught:
        read_mesh(tmp_path / name)
    assert str(caught.value).startswith(name)


@pytest.mark.parametrize(("path", "said"), [("x" * 300, "no such file"), (".", "no such file")])
def test_a_missing_file_is_refused(path: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        read_mesh(Path(path))


def test_a_file_of_another_shape_is_noticed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A warning says so where the two are near each other; where they are far apart an error does, before the work."""
    for name, shift in (("ball", 0.0), ("aside", 0.3), ("away", 500.0)):
        trimesh.Trimesh(BALL.vertices + shift, BALL.faces, process=False).export(tmp_path / f"{name}.ply")
    outcomes = {}
    for name in ("ball", "aside", "away"):
        argv = ["eval", str(tmp_path / f"{name}.ply"), str(tmp_path / "ball.ply"), "--samples", "500", "--quiet"]
        outcomes[name] = cli.main(argv), capsys.readouterr().err
    assert outcomes["ball"] == (0, "")
    assert outcomes["aside"][0] == 0
    assert outcomes["aside"][1].startswith("warning: the bounding boxes of the two differ by 0.3 radii")
    assert outcomes["away"] == (
        2,
        "mplicits: the two are different shapes: one is 501 radii away, by the other's center and scale\n",
    )
