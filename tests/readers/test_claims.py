"""Small files that claim much: refused before the memory is taken, and what is named often is read once."""

import io
import time
import zlib
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from PIL import Image

from mplicits.model import memory
from mplicits.model.errors import UserError
from mplicits.model.image_file import open_image
from mplicits.readers.content import Mesh
from mplicits.readers.gltf_file import open_gltf
from mplicits.readers.polygons import triangulated
from mplicits.readers.read import read_shape
from support.growing_files import TRIANGLE, gltf, materials, png, polygon, weights

LIMIT = r"would take .* GB of memory; 2\.\d+ GB are allowed"


def attributes(**more: int) -> dict[str, Any]:
    return {"meshes": [{"primitives": [{"attributes": {"POSITION": 0} | more}]}]}


@pytest.mark.parametrize(
    "more",
    [
        {"accessors": [{"componentType": 5126, "type": "VEC3", "count": 80_000_000}]},
        {"accessors": [{"componentType": 5126, "type": "VEC3", "count": 80_000_000, "sparse": {"count": 0}}]},
        {"accessors": [{"componentType": 5126, "type": "VEC3", "count": 200_000}], "nodes": [{"mesh": 0}] * 2000},
        {
            "accessors": [{"componentType": 5126, "type": "VEC3", "count": 200_000}],
            "meshes": [
                {
                    "primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}] * 500}],
                    "weights": [1] * 500,
                }
            ],
        },
    ],
    ids=["no view", "sparse", "instances", "morph targets"],
)
def test_claims_of_gltf_are_refused(more: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(UserError, match=LIMIT):
        read_shape(gltf(tmp_path / "a.gltf", more))


def test_too_many_primitives_are_refused(tmp_path: Path) -> None:
    mesh = {"primitives": [{"attributes": {"POSITION": 0}}] * 400}
    with pytest.raises(UserError, match="more than 100,000 instances of primitives"):
        read_shape(gltf(tmp_path / "a.gltf", {"meshes": [mesh], "nodes": [{"mesh": 0}] * 400}))


def test_an_image_is_refused_by_its_header(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd big.png\n")
    # A PNG of one bit a pixel; only its header is read.
    data = bytearray(png(8))
    data[16:24] = (30_000).to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "big.png").write_bytes(data)
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n")
    with pytest.raises(UserError, match="an image of 30,000 x 30,000 pixels " + LIMIT):
        read_shape(tmp_path / "a.obj")


def test_an_image_of_many_materials_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[object] = []
    real = Image.open

    def counted(file: io.BytesIO, **options: Any) -> Image.Image:
        opened.append(file)
        return real(file, **options)

    monkeypatch.setattr(Image, "open", counted)
    mesh = read_shape(materials(tmp_path, 200))
    assert isinstance(mesh, Mesh)
    assert mesh.paint is not None
    assert len(opened) == 1
    assert len({id(each.picture.pixels) for each in mesh.paint.materials if each.picture is not None}) == 1


@pytest.mark.parametrize("length", ["-1", "-1000000000", "1e300", "inf", "nan"])
def test_lengths_of_lists_are_compared_with_the_file(length: str, tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 1000000000\nproperty list char int vertex_indices\nend_header\n0 0 0\n"
    (tmp_path / "a.ply").write_text(head + length + "\n")
    with pytest.raises(UserError, match="it ends before the last of 1,000,000,000 rows of face"):
        read_shape(tmp_path / "a.ply")


def test_wide_tables_and_lines_are_bounded(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(",".join(["1"] * 100_000) + "\n")
    with pytest.raises(UserError, match="a table of 100,000 columns"):
        read_shape(tmp_path / "a.csv")
    (tmp_path / "a.obj").write_text("v 1 2 3 " + "1 " * 20_000 + "\n" + "v 1 2 3\n" * 20_000)
    read_shape(tmp_path / "a.obj")  # in the square of its lines it would take 3 GB


@pytest.mark.parametrize("count", [3000, 20_000])
def test_a_star_of_many_corners_is_cut_without_overlaps(count: int, tmp_path: Path) -> None:
    mesh = read_shape(polygon(tmp_path, count))
    assert isinstance(mesh, Mesh)
    assert len(mesh.faces) == count - 2
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    x, y = mesh.vertices[:, :2].T
    assert areas.min() >= 0
    assert areas.sum() == pytest.approx(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def test_a_large_polygon_that_crosses_itself_is_a_fan() -> None:
    points = np.random.default_rng(0).random((1500, 3)) * (1, 1, 0)
    triangles, _ = triangulated(points, np.array([1500]), np.arange(1500))
    assert triangles.tolist() == [[0, k, k + 1] for k in range(1, 1499)]


def test_a_polygon_that_would_take_minutes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spiral, of which each corner is looked at for each ear."""
    monkeypatch.setattr("mplicits.readers.child.SECONDS", 1.5)
    monkeypatch.setattr("mplicits.readers.child.SECONDS_A_BYTE", 0.0)
    turn = 0.05 * np.arange(16_000)
    ways = [(start + turn)[:, None] * np.stack((np.cos(turn), np.sin(turn), 0 * turn), axis=1) for start in (1, 1.02)]
    points = np.concatenate([ways[0], ways[1][::-1]])
    with pytest.raises(UserError, match="decoding it takes longer than 2 s"):
        triangulated(points, np.array([len(points)]), np.arange(len(points)))


def test_no_image_starts_another_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pillow gives PostScript to Ghostscript."""
    monkeypatch.setattr("subprocess.check_call", lambda *_, **__: pytest.fail("a program is started"))
    (tmp_path / "skin.eps").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 4 4\n%%EndComments\n")
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd skin.eps\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n")
    mesh = read_shape(tmp_path / "a.obj")
    assert isinstance(mesh, Mesh)
    assert mesh.paint is None
    with pytest.raises(UserError, match="not a readable image"):
        open_image(tmp_path / "skin.eps", "--texture")


def test_weights_of_morph_targets_are_applied_once_for_all_places(tmp_path: Path) -> None:
    path, began = weights(tmp_path, 12_000), time.process_time()
    read_shape(path)
    assert time.process_time() - began < 5  # a minute for each weight in each place


def test_a_buffer_of_many_names_fills_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "BUDGET", 0)
    monkeypatch.setattr(memory, "RATIO", 2)
    (tmp_path / "d").mkdir()
    (tmp_path / "a.bin").write_bytes(bytes(100_000))
    buffers = [{"uri": "d/../" * k + "a.bin", "byteLength": 100_000} for k in range(5)]
    opened = open_gltf(gltf(tmp_path / "a.gltf", {"buffers": buffers}))
    with pytest.raises(UserError, match="its files would take"):
        list(map(opened.buffer, range(5)))


def test_a_long_library_of_many_names_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = Mock(return_value=())
    monkeypatch.setattr("mplicits.readers.mtl.lines_of", lines)
    (tmp_path / "d").mkdir()
    (tmp_path / "a.mtl").write_text("newmtl a\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nmtllib d/../a.mtl\n{TRIANGLE}f 1 2 3\n")
    read_shape(tmp_path / "a.obj")
    lines.assert_called_once()
