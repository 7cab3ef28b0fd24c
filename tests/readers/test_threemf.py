"""3MF: objects in their places, as trimesh reads them, and archives that are made to do harm."""

import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits.model import memory
from mplicits.model.errors import UserError
from mplicits.readers import threemf
from mplicits.readers.content import Mesh
from mplicits.readers.read import read_shape

CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
PRODUCTION = 'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
SLICE = 'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"'
TETRAHEDRON = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="2" z="0"/>'
    '<vertex x="0" y="0" z="3"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>'
    '<triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/></triangles></mesh>'
)
TURNED = "0 1 0 -1 0 0 0 0 1 5 6 7"
SCALED = "2 0 0 0 2 0 0 0 2 -1 0 4"


def model(resources: str, items: str) -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" {CORE} {PRODUCTION} {SLICE}>'
        f"<resources>{resources}</resources><build>{items}</build></model>"
    )


def package(path: Path, root: str | bytes, **members: str | bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", root)
        for name, data in members.items():
            archive.writestr(name.replace("__", "/"), data)
    return path


def levels(count: int, inside: int) -> str:
    """Objects of which each has `inside` times the one before."""
    texts = [f'<object id="0">{TETRAHEDRON}</object>']
    for k in range(1, count):
        components = f'<component objectid="{k - 1}"/>' * inside
        texts.append(f'<object id="{k}"><components>{components}</components></object>')
    return "".join(texts)


def test_objects_are_placed_as_trimesh_places_them(tmp_path: Path) -> None:
    resources = (
        f'<object id="1" name="a">{TETRAHEDRON}</object><object id="2" name="b"><components>'
        f'<component objectid="1" transform="{TURNED}"/><component objectid="1"/></components></object>'
        '<s:slicestack id="9"><s:slice><s:vertices><s:vertex x="0" y="0"/></s:vertices></s:slice></s:slicestack>'
    )
    items = f'<item objectid="2" transform="{SCALED}"/><item objectid="1" transform="{TURNED}"/>'
    path = package(tmp_path / "a.3mf", model(resources, items))
    read = read_shape(path)
    assert isinstance(read, Mesh)
    assert (read.facts.meshes, len(read.vertices), len(read.faces)) == (3, 12, 12)
    want = trimesh.load_scene(path, process=False).to_mesh()
    for ours, theirs in zip(*(np.sort(v.round(9), axis=0) for v in (read.vertices, want.vertices)), strict=True):
        np.testing.assert_allclose(ours, theirs)
    assert trimesh.Trimesh(read.vertices, read.faces).volume == pytest.approx(1 + 2 * 8)


def test_objects_of_other_members_are_found(tmp_path: Path) -> None:
    other = model(f'<object id="7">{TETRAHEDRON}</object>', "")
    component = '<component p:path="/3D/Objects/b.model" objectid="7"/>'
    resources = f'<object id="1"><components>{component}</components></object>'
    path = package(tmp_path / "a.3mf", model(resources, '<item objectid="1"/>'), **{"3D__Objects__b.model": other})
    read = read_shape(path)
    assert isinstance(read, Mesh)
    assert len(read.faces) == 4


@pytest.mark.parametrize(
    ("root", "says"),
    [
        (
            model(levels(14, 10), '<item objectid="13"/>'),
            r"80,000,000,000,000 vertices and faces in 11,111,111,111,111 places",
        ),
        (model(levels(80, 1), '<item objectid="79"/>'), "objects inside of objects, 64 deep"),
        (model(f'<object id="1">{TETRAHEDRON}</object>', ""), "the mesh is empty"),
        (model('<object id="1"><mesh><triangle v1="0" v2="0" v3="0"/></mesh></object>', ""), "missing vertices"),
        (model("", '<item objectid="1" p:path="/../../etc/passwd"/>'), r"it has no '\.\./\.\./etc/passwd'"),
        (model("<object/>", ""), "an element without 'id'"),
        (model("<a>" * 9, ""), "mismatched tag"),
    ],
)
def test_what_is_made_to_do_harm_is_one_line(tmp_path: Path, root: str, says: str) -> None:
    with pytest.raises(UserError, match=says):
        threemf.decoded(str(package(tmp_path / "a.3mf", root)))


@pytest.mark.parametrize("encoding", ["UTF-8", "UTF-16"])
def test_entities_are_refused(tmp_path: Path, encoding: str) -> None:
    text = model("", "").replace("UTF-8", encoding).replace("<model", "<!DOCTYPE model><model")
    with pytest.raises(UserError, match=r"a\.3mf: its XML has a <!DOCTYPE"):
        read_shape(package(tmp_path / "a.3mf", text.encode(encoding)))


def test_members_are_unpacked_as_far_as_they_are_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "BUDGET", 1 << 20)
    text = model(f'<object id="1">{TETRAHEDRON}</object>', '<item objectid="1"/>')
    path = package(tmp_path / "a.3mf", text, **{"Metadata__thumbnail.png": bytes(1 << 21)})
    assert len(threemf.decoded(str(path))["faces"]) == 4
    with pytest.raises(UserError, match=r"models of 2,09\d,\d{3} bytes, unpacked"):
        threemf.decoded(str(package(path, text + " " * (1 << 21))))
    path = package(tmp_path / "b.3mf", text)
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.rfind(b"PK\x01\x02") + 24, 0xFFFFFFF0)
    path.write_bytes(data)
    with pytest.raises(UserError, match="models of 4,294,967,280 bytes, unpacked"):
        threemf.decoded(str(path))


def test_a_member_is_unpacked_as_far_as_the_directory_says(tmp_path: Path) -> None:
    path = package(tmp_path / "a.3mf", " " * (1 << 26))
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.rfind(b"PK\x01\x02") + 24, 1000)
    path.write_bytes(data)
    tracemalloc.start()
    with pytest.raises(zipfile.BadZipFile):
        threemf.decoded(str(path))
    assert tracemalloc.get_traced_memory()[1] < 1 << 22
    tracemalloc.stop()


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packings_without_a_bound_are_refused(tmp_path: Path, packing: int) -> None:
    for ending, name in (("3mf", "3D/3dmodel.model"), ("npz", "points.npy")):
        with zipfile.ZipFile(tmp_path / f"a.{ending}", "w", packing) as archive:
            archive.writestr(name, b"data")
        with pytest.raises(UserError, match="packed in a way that is not deflate"):
            read_shape(tmp_path / f"a.{ending}")
