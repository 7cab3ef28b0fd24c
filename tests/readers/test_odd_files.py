"""Odd spellings of formats: headers, delimiters, counts, types and materials as programs write them."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from mplicits.model.errors import UserError
from mplicits.readers.content import Mesh
from mplicits.readers.read import read_shape
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import unit

NORMALS = unit(np.random.default_rng(0).normal(size=(300, 3)))
POINTS = NORMALS * (1, 0.7, 0.5)
BYTES = np.round((0.5 + 0.4 * NORMALS) * 255)
COUNTED = np.arange(300.0)[:, None]
BALL = trimesh.creation.icosphere(2)
ESTIMATED = "normals estimated"


def rows(*columns: np.ndarray[tuple[int, ...], np.dtype[np.float64]], by: str = " ") -> str:
    return "\n".join(by.join(f"{value:.6g}" for value in row) for row in np.concatenate(columns, axis=1)) + "\n"


def packed(**arrays: object) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    return file.getvalue()


CLOUDS: dict[str, tuple[str | bytes, str, str]] = {
    "count.pts": ("300\n" + rows(POINTS, COUNTED - 50, BYTES), "columns x y z r g b", "4 (of 7)"),
    "whole.pts": (rows(POINTS, COUNTED % 200, BYTES), "columns x y z r g b", "4 (of 7)"),
    "numbered.xyz": (rows(COUNTED, POINTS, BYTES), "columns x y z r g b", "1 (of 7)"),
    "numbered.csv": (",x,y,z\n" + rows(COUNTED, POINTS, by=","), "columns x y z", "not used: 1 (of 4)"),
    "decimals.txt": (rows(POINTS, BYTES, by="\t").replace(".", ","), "columns x y z r g b", ESTIMATED),
    "bytes16.npz": (packed(points=POINTS, colors=BYTES.astype("u2")), "colors of points", ESTIMATED),
    "opacity.xyz": (rows(POINTS, BYTES, np.full((300, 1), 255.0)), "columns x y z r g b", "7 (of 7)"),
    "opacity2.xyz": (rows(POINTS, NORMALS, BYTES, np.full((300, 1), 255.0)), "x y z nx ny nz r g b", "10 (of 10)"),
    "commas.csv": ("X;Y;Z;R;G;B\n" + rows(POINTS, BYTES, by=";").replace(".", ","), "X Y Z R G B", ESTIMATED),
    "compare.txt": (
        "//X Y Z R G B Nx Ny Nz Scalar_field\n" + rows(POINTS, BYTES, NORMALS, COUNTED),
        "X Y Z R G B Nx Ny Nz",
        "Scalar_field",
    ),
    "compare.asc": ("//X Y Z R G B\n300\n" + rows(POINTS, BYTES), "X Y Z R G B", ESTIMATED),
    "pdal.csv": (
        '"X","Y","Z","Intensity","Red","Green","Blue"\n' + rows(POINTS, COUNTED, BYTES * 257, by=","),
        "X Y Z Red Green Blue",
        "Intensity",
    ),
    "words.csv": ("x,y,z,label\n" + rows(POINTS, by=",").replace("\n", ",tree\n"), "columns x y z", "label"),
    "gaps.csv": (
        "x,y,z,nx,ny,nz\n"
        + rows(POINTS[:294], NORMALS[:294], by=",")
        + rows(POINTS[294:], by=",").replace("\n", ",,,\n"),
        "294 points, normals of the file",
        "left out 6 points",
    ),
    "wide.txt": (rows(POINTS, NORMALS).encode("utf-16"), "columns x y z nx ny nz", ""),
    "turned.csv": ("nx,ny,nz,x,y,z\n" + rows(NORMALS, POINTS, by=","), "columns nx ny nz x y z", ""),
    "between.xyz": (
        "# a\n" + rows(POINTS[:9], NORMALS[:9]) + "# b\n" + rows(POINTS[9:], NORMALS[9:]),
        "300 points",
        "",
    ),
    "empty.xyz": (rows(POINTS, 0 * NORMALS, BYTES), "normals estimated, colors", "4 (of 9), 5 (of 9), 6 (of 9)"),
    "black.npz": (packed(points=POINTS, normals=NORMALS, colors=0 * BYTES), "no colors", "all colors are black"),
    "deep.xyz": (rows(POINTS, BYTES * 257), "columns x y z r g b", ESTIMATED),
    "names.npz": (packed(Points=POINTS, Normals=NORMALS, colour=BYTES.astype("u1"), label=COUNTED), "colors", "label"),
    "single.npz": (packed(**dict(zip("xyz", POINTS.T, strict=True))), "columns x y z", ESTIMATED),
    "six.npz": (packed(pc=np.concatenate((POINTS, NORMALS), axis=1)), "normals of the file", ""),
}
"""Name -> content, a part of the line, and a part of the warnings ("": none)."""


@pytest.mark.parametrize("name", CLOUDS)
def test_a_cloud_is_read(name: str, tmp_path: Path) -> None:
    content, line, warned = CLOUDS[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    shape, warnings = load_shape(str(tmp_path / name), noise=0.0)
    assert shape.taken is not None
    assert line in shape.taken.line()
    assert warned in (" ".join(warnings) + shape.taken.line() if warned else "")
    assert warned or warnings == []
    np.testing.assert_allclose(shape.scale, np.linalg.norm(POINTS, axis=1).max(), rtol=0.02)
    if shape.colored:
        drawn = shape.surface(200, np.random.default_rng(0), colors=True)
        assert drawn.colors is not None
        truth = 0.5 + 0.4 * (drawn.points * shape.scale + shape.center) / (1, 0.7, 0.5)
        np.testing.assert_allclose(drawn.colors, truth, atol=0.01)


def stl(head: bytes, count: int) -> bytes:
    triangles = b"".join(np.array([0, 0, 0, *t.ravel()], "<f4").tobytes() + b"\0\0" for t in BALL.triangles)
    return head.ljust(80, b"\0") + struct.pack("<I", count) + triangles


TEXT_STL = (
    "solid a b\n"
    + "".join(
        "FACET NORMAL 0 0 0\n OUTER LOOP\n"
        + "".join("  VERTEX {:g} {:g} {:g}\n".format(*corner) for corner in triangle)
        + " ENDLOOP\nENDFACET\n"
        for triangle in BALL.triangles
    )
    + "endsolid\n"
)
VERTICES = "".join("v {:.9g} {:.9g} {:.9g}\n".format(*vertex) for vertex in BALL.vertices)
FACES = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BALL.faces)
MESHES: dict[str, str | bytes] = {
    "solid.stl": stl(b"solid made by a program", 320),
    "zero.stl": stl(b"", 0),
    "all.stl": stl(b"", 0xFFFFFFFF),
    "text.stl": TEXT_STL,
    "cr.stl": TEXT_STL.replace("\n", "\r"),
    "points.obj": VERTICES + FACES + "p 1 2\nl 1 2 3\n",
    "tabs.obj": (VERTICES + FACES).replace(" ", "\t"),
    "signs.obj": VERTICES.replace(" ", "  +").replace("+-", "-") + FACES,
    "mesh.npz": packed(vertices=BALL.vertices, faces=BALL.faces.astype(float)),
    "signed.ply": (
        f"ply\nformat ascii 1.0\nelement vertex {len(BALL.vertices)}\n"
        "property double X\nproperty double Y\nproperty double Z\n"
        f"element face {len(BALL.faces)}\nproperty list char short vertex_indices\nend_header\n"
        + VERTICES.replace("v ", "")
        + "".join(f"3 {a} {b} {c}\n" for a, b, c in BALL.faces)
    ),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_is_read(name: str, tmp_path: Path) -> None:
    content = MESHES[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    shape, warnings = load_shape(str(tmp_path / name), crease=None)
    assert warnings == []
    assert shape.taken is not None
    assert shape.taken.line() == f"{name}: 1 mesh, 320 triangles, 1 part, no colors, y up, 2 units tall"
    assert shape.distance(np.zeros((1, 3)))[0] < -0.9


def test_two_solids_of_an_stl_are_both_read(tmp_path: Path) -> None:
    (tmp_path / "two.stl").write_text(TEXT_STL + TEXT_STL.replace("VERTEX ", "VERTEX 0").replace("0-", "-0"))
    mesh = read_shape(tmp_path / "two.stl")
    assert isinstance(mesh, Mesh)
    assert len(mesh.faces) == 640


def test_an_image_is_found_beside_the_obj_whatever_its_path(tmp_path: Path) -> None:
    (tmp_path / "my mat.mtl").write_text('newmtl m\nmap_Kd "C:\\Users\\me\\Wood Grain.PNG"\n')
    Image.new("RGB", (4, 4), (10, 200, 30)).save(tmp_path / "wood grain.png")
    faces = "".join(f"f {a + 1}/1 {b + 1}/1 {c + 1}/1\n" for a, b, c in BALL.faces)
    (tmp_path / "a.obj").write_text("mtllib my mat.mtl\nusemtl m\n" + VERTICES + "vt 0 0\n" + faces)
    shape, warnings = load_shape(str(tmp_path / "a.obj"))
    assert warnings == []
    colors = shape.surface(10, np.random.default_rng(0), colors=True).colors
    assert colors is not None
    np.testing.assert_allclose(colors, np.tile(np.array((10, 200, 30)) / 255, (10, 1)))


TINTED = "".join("v {:.9g} {:.9g} {:.9g} 0.2 0.4 0.6\n".format(*vertex) for vertex in BALL.vertices[1:])
HALF = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BALL.faces[:160])
OTHER = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BALL.faces[160:])
UNWRAPPED = "".join(f"f {a + 1}/1 {b + 1}/1 {c + 1}/1\n" for a, b, c in BALL.faces[160:])


@pytest.mark.parametrize(
    ("text", "says", "mean"),
    [
        (VERTICES.splitlines()[0] + "\n" + TINTED + FACES, "1 vertices without a color", (0.2, 0.4, 0.6)),
        ("mtllib a.mtl\n" + VERTICES + "usemtl m\n" + HALF + "usemtl x\n" + OTHER, "gray: x", None),
        (
            "mtllib b.mtl\n" + VERTICES + "vt 0 0\nusemtl m\n" + HALF + UNWRAPPED,
            "160 triangles without texture coordinates",
            (0.2, 0.4, 0.6),
        ),
    ],
)
def test_colors_that_some_parts_lack_are_said(
    text: str, says: str, mean: tuple[float, ...] | None, tmp_path: Path
) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0 0\nnewmtl n\nKd 0 1 0\n")
    (tmp_path / "b.mtl").write_text("newmtl m\nmap_Kd b.png\n")
    Image.new("RGB", (4, 4), (51, 102, 153)).save(tmp_path / "b.png")
    (tmp_path / "a.obj").write_text(text)
    shape, warnings = load_shape(str(tmp_path / "a.obj"))
    assert len(warnings) == 1
    assert says in warnings[0]
    colors = shape.surface(50, np.random.default_rng(0), colors=True).colors
    assert colors is not None
    if mean is not None:
        np.testing.assert_allclose(colors, np.tile(mean, (50, 1)), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        (
            "wall.xyz",
            rows(POINTS * (1, 1, 0), np.tile([0.0, 0, 1], (300, 1))),
            "columns 4 to 6 may be normals or colors",
        ),
        ("last.xyz", rows(POINTS, BYTES, COUNTED % 200), "columns 4 to 7, and it is not clear which are colors"),
        ("first.xyz", rows(BYTES, POINTS), "columns 1 to 3 may be points or colors"),
        ("two.xyz", rows(POINTS, NORMALS, NORMALS), "not clear which are normals; name them, as in --columns"),
        ("bytes.npz", packed(points=POINTS, colors=BYTES), "in columns of floats; they go from 0 to 1"),
        ("other.npz", packed(stuff=POINTS), "the array `points` is missing; it has stuff"),
        ("cut.stl", stl(b"", 320)[:-700], "it ends after 306 of 320 triangles"),
        ("words.xyz", "hello world\n", "not a readable XYZ file"),
    ],
)
def test_what_is_not_clear_is_refused(name: str, content: str | bytes, says: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(UserError, match=says) as refused:
        load_shape(str(tmp_path / name))
    assert str(refused.value).startswith(f"{name}: ")
