"""Loading meshes and clouds: formats, normalization, distances, and bad input."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits.model.errors import UserError
from mplicits.readers.surface import load_mesh
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh import MeshShape
from mplicits.trainer.shapes.shape import Doubles, Shape, unit

CENTER = np.array((3.0, -2.0, 5.0))


def ball(subdivisions: int = 4) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=2.0)
    mesh.apply_translation(CENTER)
    return mesh


def on_ball(count: int = 4000) -> tuple[Doubles, Doubles]:
    normals = unit(np.random.default_rng(0).normal(size=(count, 3)))
    return CENTER + 2 * normals, normals


def check_is_ball(shape: Shape, tolerance: float = 3e-3) -> None:
    np.testing.assert_allclose(shape.center, CENTER, atol=2 * tolerance)
    assert shape.scale == pytest.approx(2.0, rel=tolerance)
    points = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    exact = np.linalg.norm(points, axis=1) - 1
    error = np.abs(shape.distance(points) - exact)
    assert error[np.abs(exact) > 0.1].max() < 5 * tolerance
    surface = shape.surface(500, np.random.default_rng(2))
    assert np.abs(np.linalg.norm(surface.points, axis=1) - 1).max() < tolerance
    assert np.einsum("ij,ij->i", surface.points, surface.normals).min() > 0.99
    assert (np.linalg.norm(shape.inputs(), axis=1) < 1 + 1e-6).all()


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "glb", "PLY"])
def test_every_mesh_format_loads_a_ball(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"ball.{ending}"
    ball().export(path, file_type=ending.lower())
    shape, warnings = load_shape(str(path))
    assert not warnings
    check_is_ball(shape)
    assert shape.name == path.name
    assert shape.source["file"] == path.name
    assert len(shape.source["sha256"]) == 64


def write_cloud(path: Path, points: Doubles, normals: Doubles, colors: Doubles | None = None) -> None:
    columns = [points, normals] if colors is None else [points, normals, colors * 255]
    if path.suffix == ".npz":
        arrays: dict[str, Any] = {"points": points, "normals": normals}
        np.savez(path, **(arrays if colors is None else arrays | {"colors": colors}))
    elif path.suffix == ".xyz":
        np.savetxt(path, np.concatenate(columns, axis=1))
    else:
        names = ("x", "y", "z", "nx", "ny", "nz")
        kinds = [f"property float {name}" for name in names]
        kinds += [] if colors is None else [f"property uchar {name}" for name in ("red", "green", "blue")]
        header = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *kinds, "end_header"]
        rows = [" ".join(f"{x:.9g}" for x in (*p, *n)) for p, n in zip(points, normals, strict=True)]
        if colors is not None:
            rows = [f"{row} {' '.join(str(int(x)) for x in c * 255)}" for row, c in zip(rows, colors, strict=True)]
        path.write_text("\n".join([*header, *rows, ""]))


@pytest.mark.parametrize("ending", ["ply", "xyz", "npz"])
@pytest.mark.parametrize("colored", [False, True])
def test_every_cloud_format_loads_a_ball(tmp_path: Path, ending: str, colored: bool) -> None:
    points, normals = on_ball()
    path = tmp_path / f"ball.{ending}"
    write_cloud(path, points, normals, np.tile((1.0, 0.0, 1.0), (len(points), 1)) if colored else None)
    shape, _ = load_shape(str(path))
    check_is_ball(shape, tolerance=2e-2)
    assert shape.colored == colored
    if colored:
        colors = shape.surface(10, np.random.default_rng(0), colors=True).colors
        assert colors is not None
        np.testing.assert_allclose(colors, [(1, 0, 1)] * 10)


def test_training_never_sees_held_out_points_of_a_cloud(tmp_path: Path) -> None:
    points, normals = on_ball()
    write_cloud(tmp_path / "ball.npz", points, normals)
    shape, _ = load_shape(str(tmp_path / "ball.npz"))
    kept = {tuple(p) for p in shape.surface(4000, np.random.default_rng(0)).points}
    held = {tuple(p) for p in shape.surface(4000, np.random.default_rng(0), held_out=True).points}
    assert len(kept) == 3800
    assert len(held) == 200
    assert not kept & held


def test_an_open_mesh_causes_a_warning_and_has_signed_distances(tmp_path: Path) -> None:
    mesh = ball()
    mesh.update_faces(np.arange(len(mesh.faces)) > 20)
    mesh.export(tmp_path / "open.ply")
    shape, warnings = load_shape(str(tmp_path / "open.ply"))
    assert len(warnings) == 1
    assert "not watertight" in warnings[0]
    assert shape.distance(np.zeros((1, 3)))[0] < -0.9


def test_mesh_samples_are_uniform_by_area(tmp_path: Path) -> None:
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.ply")
    normals = load_shape(str(tmp_path / "box.ply"))[0].surface(40_000, np.random.default_rng(0)).normals
    shares = np.abs(normals).round().mean(axis=0)
    np.testing.assert_allclose(shares, np.array((6, 3, 2)) / 11, atol=0.01)


def nan_mesh(path: Path) -> None:
    mesh = ball(1)
    text = ["ply", "format ascii 1.0", f"element vertex {len(mesh.vertices)}"]
    text += [f"property float {c}" for c in "xyz"]
    text += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    text += ["nan 0 0", *(" ".join(map(str, v)) for v in mesh.vertices[1:])]
    path.write_text("\n".join([*text, *(f"3 {a} {b} {c}" for a, b, c in mesh.faces), ""]))


def empty_ply(path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
    path.write_text(head + "element face 0\nproperty list uchar int vertex_indices\nend_header\n")


def flat(path: Path) -> None:
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(path)


REFUSED = [
    ("missing.ply", None, "no such file"),
    ("shape.xyzw", lambda path: path.write_text("1 2 3"), "unknown shape format"),
    ("picture.png", lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64)), "unknown shape format"),
    ("picture.ply", lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64)), "not a readable PLY"),
    ("picture.glb", lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64)), "not a readable GLB"),
    ("picture.stl", lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64)), "picture.stl: "),
    ("empty.ply", empty_ply, "empty"),
    ("empty.obj", lambda path: path.write_text(""), "empty.obj: "),
    ("flat.obj", lambda path: path.write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n"), "points have 2 coordinates"),
    ("nan.ply", nan_mesh, "not finite"),
    ("triangle.ply", flat, "encloses no volume"),
    ("triangle.stl", flat, "encloses no volume"),
    ("few.npz", lambda path: write_cloud(path, *on_ball(5)), "at least 100"),
    ("text.xyz", lambda path: path.write_text("hello world\n"), "not a readable XYZ"),
    ("shape.npz", lambda path: np.savez(path, points=np.zeros((9, 2)), normals=np.zeros((9, 3))), "shape (9, 2)"),
    ("nan.npz", lambda path: write_cloud(path, np.full((200, 3), np.nan), on_ball(200)[1]), "not finite"),
    ("point.npz", lambda path: write_cloud(path, np.ones((200, 3)), on_ball(200)[1]), "one point"),
]


@pytest.mark.parametrize(("name", "write", "says"), REFUSED, ids=[name for name, _, _ in REFUSED])
def test_bad_input_is_one_line(tmp_path: Path, name: str, write: object, says: str) -> None:
    if callable(write):
        write(tmp_path / name)
    with pytest.raises(UserError) as refusal:
        load_shape(str(tmp_path / name))
    assert says in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert Path(name).stem in str(refusal.value)


def line(form: str, binary: bool, numbers: list[Any]) -> bytes:
    return struct.pack(form, *numbers) if binary else (" ".join(map(str, numbers)) + "\n").encode()


def strips_ply(path: Path, binary: bool, rows: list[list[int]]) -> None:
    """Write a ball with vertex normals, vertex colors and triangle strips."""
    mesh = ball(2)
    head = ["ply", f"format {'binary_big_endian' if binary else 'ascii'} 1.0", f"element vertex {len(mesh.vertices)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    head += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += [f"element tristrips {len(rows)}", "property list int int vertex_indices", "end_header", ""]
    data = "\n".join(head).encode()
    for vertex, normal in zip(mesh.vertices.tolist(), mesh.vertex_normals.tolist(), strict=True):
        data += line(">6f3B", binary, [*vertex, *normal, 200, 100, 0])
    for row in rows:
        data += line(f">{len(row) + 1}i", binary, [len(row), *row])
    path.write_bytes(data)


@pytest.mark.parametrize("binary", [True, False], ids=["bytes", "text"])
def test_triangle_strips_become_a_mesh(tmp_path: Path, binary: bool) -> None:
    """One strip per triangle, but the first strip has two: c b d continues a b c; a repeated vertex adds none."""
    faces = ball(2).faces.tolist()
    a, b, c = faces[0]
    second = next(k for k, face in enumerate(faces) if k and {b, c} <= set(face))
    (d,) = set(faces[second]) - {b, c}
    others = [face for k, face in enumerate(faces) if k not in {0, second}]
    strips_ply(tmp_path / "s.ply", binary, [[a, b, c, d, d, -1, *(v for face in others for v in (*face, -1))]])
    shape, warnings = load_shape(str(tmp_path / "s.ply"))
    assert isinstance(shape, MeshShape)
    assert not warnings, "it is closed, and its faces point outwards"
    assert len(load_mesh(tmp_path / "s.ply").faces) == len(faces)
    assert shape.distance(np.zeros((1, 3)))[0] < -0.9
    drawn = shape.surface(5, np.random.default_rng(0), colors=True)
    assert drawn.colors is not None
    assert np.abs(drawn.colors * 255 - (200, 100, 0)).max() < 1e-9


def test_a_name_with_control_characters_is_escaped(tmp_path: Path) -> None:
    path = tmp_path / 'a\n"*<script>.ply'
    path.write_text("not a mesh")
    with pytest.raises(UserError) as refusal:
        load_shape(str(path))
    assert "\n" not in str(refusal.value)
    ball(1).export(path)
    assert "\n" not in load_shape(str(path))[0].name
