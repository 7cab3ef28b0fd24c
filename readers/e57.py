"""Reads E57 files, by pye57 in a process of its own."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from .child import in_child
from .child_process import one_more_file
from .claims import check_points
from .clouds import finite_cloud
from .content import Cloud, Facts
from .frames import Arrays
from .xml_text import refuse_entities

HEADER = struct.Struct("<8s8xQQQQ")
"""Signature, bytes of the file, place of the XML part, its length without checksums, bytes of a page."""
PAGE, CHECKSUM = 1024, 4
DAMAGED = "not a readable E57 file"


def read_e57(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read all scans, in their common coordinates. Raises UserError."""
    found = in_child(decoded, ("pye57",), path.stat().st_size, path=str(path))
    rgb, count = found.get("rgb"), int(found["scans"])
    colors = None if rgb is None else rgb / (255.0 if rgb.max() <= 255 else 65535.0)
    return finite_cloud(found["points"], None, colors, Facts(taken=[f"{count} scan{'s' * (count != 1)}"]))


def decoded(path: str) -> Arrays:
    """Return "points" (N, 3), "rgb" (N, 3) if all scans have it, and how many "scans" there are. Raises UserError."""
    import pye57

    refuse_entities(xml_part(Path(path)), schemas=False)
    library: Any = pye57
    with one_more_file():  # its reader of XML opens what entities name
        file = library.E57(path)
        scans = range(int(file.scan_count))
        if not scans:
            raise UserError("no scan in it")
        _check_counts([int(file.get_header(number).point_count) for number in scans], Path(path).stat().st_size)
        read = [file.read_scan(number, colors=True, ignore_missing_fields=True) for number in scans]
    points, colors = [], []
    for scan in read:
        points.append(np.stack([np.asarray(scan[f"cartesian{axis}"], np.float64) for axis in "XYZ"], axis=1))
        rgb = [scan.get(f"color{name}") for name in ("Red", "Green", "Blue")]
        if all(channel is not None for channel in rgb):
            colors.append(np.stack(rgb, axis=1))
    found = {"points": np.concatenate(points), "scans": np.array(len(scans))}
    return found | ({"rgb": np.concatenate(colors)} if len(colors) == len(scans) else {})


def xml_part(path: Path) -> bytes:
    """Return the XML of a file, from its pages of 1,020 bytes and a checksum each. Raises UserError."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(HEADER.size)
        if len(head) < HEADER.size or not head.startswith(b"ASTM-E57"):
            raise UserError(DAMAGED)
        _, length, at, count, page = HEADER.unpack(head)
        if page != PAGE:
            raise UserError(f"{DAMAGED} (pages of {page:,} bytes)")
        # The library takes a place inside of a checksum for its start.
        ahead = min(at % PAGE, PAGE - CHECKSUM)
        last = at - at % PAGE + -(-(ahead + count) // (PAGE - CHECKSUM)) * PAGE
        if length != size or at < HEADER.size or last > size:
            raise UserError(f"{DAMAGED} (it is cut off: its XML part is not where its header says)")
        file.seek(at - at % PAGE)
        pages = np.frombuffer(file.read(last - (at - at % PAGE)), np.uint8).reshape(-1, PAGE)
    return pages[:, : PAGE - CHECKSUM].tobytes()[ahead : ahead + count]


def _check_counts(counts: list[int], size: int) -> None:
    """Check what the scans claim. Raises UserError."""
    if min(counts) < 0:
        raise UserError(f"{DAMAGED} (it claims {min(counts):,} points)")
    check_points(sum(counts), size)
