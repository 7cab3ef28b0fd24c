"""Formats of other libraries: each is written by its own library, or is OFF and 3MF, and read as what was written."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.readers.content import Cloud, Mesh
from mplicits.readers.read import read_shape
from support import library_files
from support.library_files import COLORS, POINTS, TRIANGLES, write_scene
from support.written_glb import Glb
from support.written_shapes import CORNERS


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
    library_files.mesh(tmp_path / f"a.{ending}")
    assert_box(read_shape(tmp_path / f"a.{ending}"))


@pytest.mark.parametrize("encoding", ["BINARY", "BINARY_COMPRESSED"])
def test_pcd(tmp_path: Path, encoding: str) -> None:
    library_files.pcd(tmp_path / "a.pcd", encoding)
    assert_cloud(tmp_path / "a.pcd")


@pytest.mark.parametrize(("ending", "top"), [("las", 65535), ("laz", 65535), ("las", 255)])
def test_las(tmp_path: Path, ending: str, top: int) -> None:
    library_files.las(tmp_path / f"a.{ending}", top)
    assert_cloud(tmp_path / f"a.{ending}")


def test_e57(tmp_path: Path) -> None:
    library_files.e57(tmp_path / "a.e57")
    assert_cloud(tmp_path / "a.e57")


@pytest.mark.parametrize("write", [library_files.draco, library_files.meshopt])
def test_compressed_gltf(tmp_path: Path, write: Callable[[Path], None]) -> None:
    write(tmp_path / "a.glb")
    assert_box(read_shape(tmp_path / "a.glb"))


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
    write_scene(glb, {"attributes": {"POSITION": position}, "extensions": extensions}, tmp_path / "a.glb")
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    monkeypatch.setattr("mplicits.model.extras.find_spec", lambda module: None)
    monkeypatch.delenv("MPLICITS_RUN", raising=False)
    assert cli.main(["check", str(tmp_path / "a.glb")]) == 2
    said = (
        "mplicits: KHR_draco_mesh_compression needs the package 'DracoPy'; run: pip install 'mplicits[formats]' (90 MB)"
    )
    assert capsys.readouterr().err.strip() == said
