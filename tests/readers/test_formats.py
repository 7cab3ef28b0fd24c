"""Formats of other libraries: each is written by its own library, or is OFF and 3MF, and read as what was written."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.readers.content import Cloud, Mesh
from mplicits.readers.read import read_shape
from support import needs
from support.written_glb import Glb
from support.written_shapes import CORNERS, QUADS

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-1, 1, (200, 3)) * (3, 2, 1)
COLORS = RNG.integers(0, 256, (200, 3)) / 255
TRIANGLES = np.array([(q[0], q[i], q[i + 1]) for q in QUADS for i in (1, 2)])


def assert_cloud(path: Path, tolerance: float = 1e-6) -> None:
    cloud = read_shape(path)
    assert isinstance(cloud, Cloud)
    np.testing.assert_allclose(cloud.points, POINTS, atol=tolerance)
    assert cloud.colors is not None
    np.testing.assert_allclose(cloud.colors, COLORS, atol=1e-4)


def assert_box(content: Mesh | Cloud) -> None:
    assert isinstance(content, Mesh)
    mesh = trimesh.Trimesh(content.vertices, content.faces)
    assert mesh.volume == pytest.approx(6, rel=1e-3)
    assert mesh.bounds.tolist() == [[0, 0, 0], pytest.approx([3, 2, 1], rel=1e-3)]


@pytest.mark.parametrize("ending", ["off", "3mf"])
def test_meshes_by_trimesh(tmp_path: Path, ending: str) -> None:
    trimesh.Trimesh(CORNERS, TRIANGLES).export(tmp_path / f"a.{ending}")
    assert_box(read_shape(tmp_path / f"a.{ending}"))


def test_pcd(tmp_path: Path) -> None:
    pypcd4: Any = needs.package("pypcd4")
    bits = (np.round(COLORS * 255).astype(np.uint32) << np.array([16, 8, 0], np.uint32)).sum(axis=1, dtype=np.uint32)
    columns = np.column_stack((POINTS.astype(np.float32), bits.view(np.float32)))
    cloud = pypcd4.PointCloud.from_xyzrgb_points(columns)
    for encoding in (pypcd4.Encoding.BINARY, pypcd4.Encoding.BINARY_COMPRESSED):
        cloud.save(tmp_path / "a.pcd", encoding=encoding)
        assert_cloud(tmp_path / "a.pcd")


@pytest.mark.parametrize(("ending", "top"), [("las", 65535), ("laz", 65535), ("las", 255)])
def test_las(tmp_path: Path, ending: str, top: int) -> None:
    laspy: Any = needs.package("laspy")
    needs.package("lazrs")
    las = laspy.create(point_format=2)
    las.header.scales, las.header.offsets = (1e-7,) * 3, (0, 0, 0)
    las.x, las.y, las.z = POINTS.T
    las.red, las.green, las.blue = np.round(COLORS.T * top).astype(np.uint16)
    las.write(tmp_path / f"a.{ending}")
    assert_cloud(tmp_path / f"a.{ending}")


def test_e57(tmp_path: Path) -> None:
    pye57: Any = needs.package("pye57")
    file = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    colors = np.round(COLORS * 255).astype(np.uint8)
    data = {f"cartesian{axis}": POINTS[:, k] for k, axis in enumerate("XYZ")}
    file.write_scan_raw(data | {f"color{name}": colors[:, k] for k, name in enumerate(("Red", "Green", "Blue"))})
    file.close()
    assert_cloud(tmp_path / "a.e57")


def test_draco(tmp_path: Path) -> None:
    draco: Any = needs.package("DracoPy")
    glb = Glb()
    data = draco.encode(CORNERS.astype(np.float32), TRIANGLES.astype(np.uint32), quantization_bits=16)
    mesh = draco.decode(data)
    (number,) = [each["unique_id"] for each in mesh.attributes if each["attribute_type"] == 0]
    position = glb.described(type="VEC3", componentType=5126, count=8)
    index = glb.described(type="SCALAR", componentType=5125, count=36)
    compressed = {"bufferView": glb.view(data), "attributes": {"POSITION": number}}
    extensions = {"KHR_draco_mesh_compression": compressed}
    write_scene(glb, {"attributes": {"POSITION": position}, "indices": index, "extensions": extensions}, tmp_path)
    assert_box(read_shape(tmp_path / "a.glb"))


def test_meshopt(tmp_path: Path) -> None:
    meshopt: Any = needs.package("meshoptimizer")
    glb = Glb()
    views = []
    vertices = meshopt.encode_vertex_buffer(CORNERS.astype(np.float32), 8, 12)
    indices = meshopt.encode_index_buffer(TRIANGLES.astype(np.uint32).ravel(), 36, 8)
    for packed, stride, mode, count in ((vertices, 12, "ATTRIBUTES", 8), (indices, 4, "TRIANGLES", 36)):
        data = bytes(packed)
        view = glb.view(data)
        described = glb.document["bufferViews"][view]
        described["extensions"] = {
            "EXT_meshopt_compression": {
                "buffer": 0,
                "byteOffset": described["byteOffset"],
                "byteLength": len(data),
                "byteStride": stride,
                "mode": mode,
                "count": count,
            }
        }
        views.append(view)
    position = glb.described(bufferView=views[0], type="VEC3", componentType=5126, count=8)
    index = glb.described(bufferView=views[1], type="SCALAR", componentType=5125, count=36)
    write_scene(glb, {"attributes": {"POSITION": position}, "indices": index}, tmp_path)
    assert_box(read_shape(tmp_path / "a.glb"))


def write_scene(glb: Glb, primitive: dict[str, Any], folder: Path) -> None:
    glb.document |= {"meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    (folder / "a.glb").write_bytes(glb.to_bytes())


def test_a_gltf_with_its_files(tmp_path: Path) -> None:
    scene: Any = trimesh.Scene(trimesh.Trimesh(CORNERS, TRIANGLES))
    for name, data in scene.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    assert_box(read_shape(tmp_path / "model.gltf"))
    next(tmp_path.glob("*.bin")).unlink()
    with pytest.raises(UserError, match="is not there; keep it beside the glTF"):
        read_shape(tmp_path / "model.gltf")


def test_a_missing_package_is_named_with_its_extension_and_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    glb = Glb()
    position = glb.described(type="VEC3", componentType=5126, count=8)
    compressed = {"bufferView": glb.view(b"DRACO"), "attributes": {"POSITION": 0}}
    extensions = {"KHR_draco_mesh_compression": compressed}
    write_scene(glb, {"attributes": {"POSITION": position}, "extensions": extensions}, tmp_path)
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    monkeypatch.setattr("mplicits.model.extras.find_spec", lambda module: None)
    monkeypatch.delenv("MPLICITS_RUN", raising=False)
    assert cli.main(["check", str(tmp_path / "a.glb")]) == 2
    said = (
        "mplicits: KHR_draco_mesh_compression needs the package 'DracoPy'; run: pip install 'mplicits[formats]' (90 MB)"
    )
    assert capsys.readouterr().err.strip() == said


@pytest.mark.parametrize("name", ["EXT_made_up", "KHR_gaussian_splatting"])
def test_an_unknown_required_extension_is_refused_by_name(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "extensionsRequired": [name]}))
    with pytest.raises(UserError, match=f"requires the extension {name}"):
        read_shape(tmp_path / "a.gltf")
