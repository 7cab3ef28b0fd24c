"""Reads LAS and LAZ files, by laspy in a process of its own."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from .child import in_child
from .claims import check_points
from .clouds import finite_cloud
from .content import Cloud, Facts
from .frames import Arrays

HEADER = struct.Struct("<4s21xB68xHIIBHI")
"""Signature, minor version, size of the header, start of the points, records, format, bytes and number of points."""
WIDE_COUNT = 247  # where version 1.4 has the number of points
RECORD = 54  # least bytes of a record between header and points
CUT = "not a readable LAS or LAZ file (it is cut off"


def read_las(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read points, their normals, and their colors of 8 or 16 bits. Raises UserError."""
    packages = ("laspy", "lazrs") if path.suffix.lower() == ".laz" else ("laspy",)
    found = in_child(decoded, packages, path.stat().st_size, path=str(path))
    rgb, colors = found.get("rgb"), None
    if rgb is not None and rgb.any():  # many programs write bytes into the 16 bits
        colors = rgb / (255.0 if rgb.max() <= 255 else 65535.0)
    normals = " normals" * ("normals" in found)
    facts = Facts(taken=["columns x y z" + normals + " red green blue" * (colors is not None)])
    return finite_cloud(found["points"], found.get("normals"), colors, facts)


def decoded(path: str) -> Arrays:
    """Return "points" (N, 3), and "normals" (N, 3) and whole "rgb" (N, 3) if it has them. Raises UserError."""
    import laspy

    check_las(Path(path))
    library: Any = laspy
    # Records after the points, which nothing here needs, may claim any length: they are not read.
    with library.open(path, read_evlrs=False) as file:
        points, names = file.read_points(-1), set(file.header.point_format.dimension_names)
    found = {"points": np.stack([np.asarray(points[axis], np.float64) for axis in "xyz"], axis=1)}
    if {"NormalX", "NormalY", "NormalZ"} <= names:
        found["normals"] = np.stack([np.asarray(points[f"Normal{axis}"], np.float64) for axis in "XYZ"], axis=1)
    if {"red", "green", "blue"} <= names:
        found["rgb"] = np.stack([np.asarray(points[name]) for name in ("red", "green", "blue")], axis=1)
    return found


def check_las(path: Path) -> None:
    """Raise UserError if the header claims more points, records or chunks than the file can have."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(WIDE_COUNT + 8)
        if len(head) < HEADER.size or not head.startswith(b"LASF"):
            raise UserError("not a readable LAS or LAZ file")
        _, minor, start, points_at, records, kind, record, count = HEADER.unpack_from(head)
        if minor >= 4:
            if len(head) < WIDE_COUNT + 8:
                raise UserError(f"{CUT})")
            (count,) = struct.unpack_from("<Q", head, WIDE_COUNT)
        if points_at > size or start + RECORD * records > points_at:
            raise UserError(f"{CUT}: it claims {records:,} records in a header of {points_at:,} bytes)")
        compressed = kind & 0x80
        if not compressed and points_at + count * record > size:
            raise UserError(f"{CUT}: it claims {count:,} points, and holds {(size - points_at) // max(record, 1):,})")
        check_points(count, size, record)
        if compressed and count:
            _check_chunks(file, points_at, size)


def _check_chunks(file: Any, points_at: int, size: int) -> None:
    """Check the number of chunks of LAZ: its decoder allocates that many, and ends the process if it cannot."""
    file.seek(points_at)
    table = int.from_bytes(file.read(8), "little", signed=True)
    if table == -1:  # the writer could not seek: the place is at the end
        file.seek(size - 8)
        table = int.from_bytes(file.read(8), "little", signed=True)
    if not points_at < table <= size - 8:
        raise UserError(f"{CUT}: its table of chunks is not there)")
    file.seek(table + 4)
    chunks = int.from_bytes(file.read(4), "little")
    if chunks > size:
        raise UserError(f"{CUT}: it claims {chunks:,} chunks in {size:,} bytes)")
