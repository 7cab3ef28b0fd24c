"""Hostile files: what they claim is compared with their bytes, and nothing that they name is opened."""

import io
import socket
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mplicits.model import memory
from mplicits.model.errors import UserError
from mplicits.readers import e57, gltf_meshopt, las, pcd
from mplicits.readers.read import read_shape
from mplicits.readers.xml_text import refuse_entities
from support import needs

ENTITY = '<!DOCTYPE r [<!ENTITY % p SYSTEM "http://127.0.0.1:{port}/">%p;]>'


def declared(encoding: str, rest: str = ENTITY) -> str:
    return f'<?xml version="1.0" encoding="{encoding}"?>\n{rest}<r/>'


@pytest.mark.parametrize(
    "xml",
    [
        declared("UTF-8").encode("utf-8-sig"),
        declared("ISO-8859-1").encode("latin-1"),
        *(declared(name).encode(name) for name in ("utf-16", "utf-16-le", "utf-16-be", "utf-32")),
        declared("UTF-16LE", "").encode() + ENTITY.encode("utf-16-le"),
        b"<!-- x --><!doctype r><r/>",
        b'<r><!ENTITY a "b"></r>',
    ],
)
def test_entities_are_refused_in_every_encoding(xml: bytes) -> None:
    with pytest.raises(UserError, match=r"its XML has a <!(DOCTYPE|ENTITY)"):
        refuse_entities(xml)


@pytest.mark.parametrize("name", ["cp037", "cp1140", "utf-7"])
def test_encodings_that_hide_entities_are_refused(name: str) -> None:
    with pytest.raises(UserError, match="in an unknown encoding"):
        refuse_entities(declared(name).encode(name))


@pytest.mark.parametrize("name", ["utf-8", "UTF-8-sig", "utf-16", "utf-16-be", "us-ascii", "windows-1252"])
def test_plain_xml_is_taken(name: str) -> None:
    refuse_entities(declared(name.removesuffix("-sig"), "<!-- DOCTYPE -->").encode(name))


def e57_file(path: Path, xml: bytes, **header: int) -> Path:
    """Write pages with a header and XML; its library would not come to look at checksums."""
    text = bytes(48) + xml
    pages = [text[k : k + 1020].ljust(1024, b"\0") for k in range(0, len(text), 1020)]
    values = {"length": 1024 * len(pages), "at": 48, "count": len(xml), "page": 1024} | header
    path.write_bytes(struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, *values.values()) + b"".join(pages)[48:])
    return path


def test_e57_opens_no_connection_and_no_file(tmp_path: Path) -> None:
    needs.package("pye57")
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.1)
        xml = declared("UTF-8", ENTITY.format(port=server.getsockname()[1])).encode()
        with pytest.raises(UserError, match=r"a\.e57: its XML has a <!DOCTYPE"):
            read_shape(e57_file(tmp_path / "a.e57", xml))
        with pytest.raises(TimeoutError):
            server.accept()


@pytest.mark.parametrize("name", ["schemaLocation", "noNamespaceSchemaLocation"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_e57_names_no_schema(name: str, encoding: str, tmp_path: Path) -> None:
    """Its library validates, and would fetch it: what else hinders it, Windows does not have."""
    needs.package("pye57")
    space = 'xmlns:a="http://www.w3.org/2001/XMLSchema-instance"'
    xml = f'<?xml version="1.0" encoding="{encoding}"?><r {space} a:{name}="http://127.0.0.1/x"/>'.encode(encoding)
    refuse_entities(xml)
    with pytest.raises(UserError, match=r"a\.e57: its XML has a schemaLocation"):
        read_shape(e57_file(tmp_path / "a.e57", xml))


@pytest.mark.parametrize(
    "header",
    [{"at": 10**12}, {"at": 2**64 - 1}, {"at": 0}, {"count": 10**15}, {"length": 10}, {"page": 512}, {"page": 0}],
)
def test_an_e57_whose_xml_is_elsewhere_is_refused(tmp_path: Path, header: dict[str, int]) -> None:
    with pytest.raises(UserError, match="not a readable E57 file"):
        e57.xml_part(e57_file(tmp_path / "a.e57", b"<r/>", **header))


def test_points_of_e57_take_a_bit_each() -> None:
    e57._check_counts([8000, 0], 1000)
    for counts, says in (([102_001], "102,001 points in 1,000 bytes"), ([-1], "-1 points")):
        with pytest.raises(UserError, match=says):
            e57._check_counts(counts, 1000)


def las_file(path: Path, *, kind: int = 2, points: int = 1, records: int = 0, table: int = 0, chunks: int = 1) -> Path:
    """Write a header of version 1.2, and a chunk table in place of points if it is packed."""
    head = struct.pack("<4s20xBB68xHIIBHI116x", b"LASF", 1, 2, 227, 227, records, kind, 26, points)
    path.write_bytes(head + struct.pack("<qII", table or 235, 0, chunks) + bytes(10))
    return path


def test_headers_of_las_are_read_as_they_are_written(tmp_path: Path) -> None:
    las.check_las(las_file(tmp_path / "a.las"))
    las.check_las(las_file(tmp_path / "a.laz", kind=130))
    path = las_file(tmp_path / "b.laz", kind=130, table=-1)
    path.write_bytes(path.read_bytes() + struct.pack("<q", 235))  # a writer that could not seek
    las.check_las(path)


@pytest.mark.parametrize(
    ("claim", "says"),
    [
        ({"points": 2}, "claims 2 points, and holds 1"),
        ({"points": 0xFFFFFFFF}, "claims 4,294,967,295 points"),
        ({"records": 1}, "claims 1 records"),
        ({"kind": 130, "points": 100_000_000}, "it claims 100,000,000 points in"),
        ({"kind": 130, "chunks": 0xFFFFFFFF}, "claims 4,294,967,295 chunks in 253 bytes"),
        ({"kind": 130, "table": 1 << 40}, "its table of chunks is not there"),
        ({"kind": 130, "table": -1}, "its table of chunks is not there"),
    ],
)
def test_claims_of_las(tmp_path: Path, claim: dict[str, int], says: str) -> None:
    with pytest.raises(UserError, match=says):
        las.check_las(las_file(tmp_path / "a.laz", **claim))


@pytest.mark.parametrize(
    ("claim", "says"),
    [
        ({"count": "1 1 1000000000"}, "COUNT: more than 10,000 numbers a point"),
        ({"count": "1 1 -5"}, "count.2 Input should be greater than 0"),
        ({"points": 10**9}, "more points than it holds"),
        ({"points": 10**9, "data": "binary"}, "more points than it holds"),
        ({"points": 2, "data": "binary_compressed"}, r"2 points would take 27\.5 GB"),
        ({"end": "DATA ascii"}, "its header does not end"),
    ],
)
def test_claims_of_pcd(tmp_path: Path, claim: dict[str, Any], says: str) -> None:
    needs.package("pypcd4")
    values: dict[str, Any] = {"count": "1 1 1", "points": 2, "data": "ascii", "end": "DATA {data}\n"} | claim
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT {count}\nWIDTH 2\nHEIGHT 1\nPOINTS {points}\n"
    body = struct.pack("<II", 4, 0xCCCCCCCC) + bytes(4) if values["data"] == "binary_compressed" else b"0 0 0\n1 1 1\n"
    text = (head + values["end"]).format(**values).encode()
    (tmp_path / "a.pcd").write_bytes(text + (body if text.endswith(b"\n") else b""))
    with pytest.raises(UserError, match=says):
        pcd.decoded(str(tmp_path / "a.pcd"))


def array_file(values: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def archive(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as written:
        for name, data in members.items():
            written.writestr(name.replace("__", "/"), data)
    return path


@pytest.fixture
def small_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Allow a megabyte, that bombs may be small."""
    monkeypatch.setattr(memory, "BUDGET", 1 << 20)


@pytest.mark.usefixtures("small_budget")
def test_an_archive_of_arrays_is_unpacked_as_far_as_it_is_used(tmp_path: Path) -> None:
    points, bomb = array_file(np.eye(4, 3)), array_file(np.zeros((20_000, 3)))
    read_shape(archive(tmp_path / "a.npz", **{"points.npy": points, "other.npy": bomb, "else.npy": b"no array"}))
    with pytest.raises(UserError, match=r"60,000 numbers in `points` would take 0\.00144 GB"):
        read_shape(archive(tmp_path / "b.npz", **{"points.npy": bomb}))


@pytest.mark.parametrize("shape", ["(1000000000, 3)", "(-1, 3)", "(-5, -3)"])
def test_a_shape_that_an_archive_does_not_hold_is_refused(tmp_path: Path, shape: str) -> None:
    data = array_file(np.zeros((1, 3))).replace(b"(1, 3), }".ljust(len(shape) + 3), f"{shape}, }}".encode(), 1)
    assert shape.encode() in data
    with pytest.raises(UserError, match=r"array `points` is cut off"):
        read_shape(archive(tmp_path / "a.npz", **{"points.npy": data}))


def test_an_archive_is_not_unpickled(tmp_path: Path) -> None:
    data = archive(tmp_path / "a.npz", **{"points.npy": array_file(np.array([{}], object))})
    with pytest.raises(UserError, match="allow_pickle=False"):
        read_shape(data)


def directory_says(path: Path, size: int) -> None:
    """Let the directory of an archive claim that its last member has `size` bytes, unpacked."""
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.rfind(b"PK\x01\x02") + 24, size)
    path.write_bytes(data)


def test_a_directory_that_lies_is_refused(tmp_path: Path) -> None:
    data = array_file(np.zeros((1000, 3))).replace(b"(1000, 3), }   ", b"(1000000, 3), }", 1)
    path = archive(tmp_path / "a.npz", **{"points.npy": data})
    directory_says(path, 0xFFFFFFF0)
    with pytest.raises(UserError, match="not a readable NPZ file"):
        read_shape(path)


@pytest.mark.parametrize(
    ("filtered", "strides"),
    [("QUATERNION", {8}), ("OCTAHEDRAL", {4, 8}), ("EXPONENTIAL", {*range(4, 257, 4)}), ("NONE", {*range(4, 257, 4)})],
)
def test_each_filter_of_meshopt_has_its_strides(filtered: str, strides: set[int]) -> None:
    for stride in range(-4, 300):
        if stride in strides:
            gltf_meshopt.check(10, stride, "ATTRIBUTES", filtered, b"\xa0")
        else:
            with pytest.raises(ValueError, match=f"with a stride of {stride}"):
                gltf_meshopt.check(10, stride, "ATTRIBUTES", filtered, b"\xa0")


@pytest.mark.parametrize(
    "wrong",
    [
        (10, 4, "TRIANGLES", "NONE", b"\xe1"),
        (9, 8, "TRIANGLES", "NONE", b"\xe1"),
        (9, 3, "INDICES", "NONE", b"\xd1"),
        (9, 4, "TRIANGLES", "EXPONENTIAL", b"\xe1"),
        (9, 4, "ATTRIBUTES", "COLOR", b"\xa0"),
        (9, 4, "ATTRIBUTES", "INDICES", b"\xa0"),
        (9, 4, "NONE", "NONE", b"\xa0"),
        (9, 4, ["ATTRIBUTES"], "NONE", b"\xa0"),
        (9, 4, "ATTRIBUTES", None, b"\xa0"),
        (0, 4, "ATTRIBUTES", "NONE", b"\xa0"),
        (1 << 27, 4, "ATTRIBUTES", "NONE", b"\xa0"),
        (9, 4, "ATTRIBUTES", "NONE", b"\xd1"),
        (9, 4, "ATTRIBUTES", "NONE", b""),
    ],
)
def test_what_meshopt_only_asserts_is_checked_before(wrong: tuple[Any, ...]) -> None:
    with pytest.raises(ValueError, match=r"."):
        gltf_meshopt.check(*wrong)
