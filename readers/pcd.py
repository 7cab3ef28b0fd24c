"""Reads PCD files of PCL, by pypcd4 in a process of its own."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import show
from ..model.memory import check_claim
from .child import in_child
from .claims import check_points
from .clouds import cloud_of_columns
from .content import Cloud
from .frames import Arrays

LINES = 10  # of a header, as pypcd4 counts them
LONGEST = 1 << 20  # most bytes of a header
MOST_COLUMNS = 10_000  # numbers a point; PCL's longest descriptor has 1,980
COPIES, A_POINT = 8, 100  # of the columns in both processes, and bytes of memory for the point that they become
CUT = "not a readable PCD file (it is cut off"


def read_pcd(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read points with all their columns. Raises UserError."""
    columns = in_child(decoded, ("pypcd4",), path.stat().st_size, path=str(path))
    return cloud_of_columns(list(columns), list(columns.values()), chosen)


def decoded(path: str) -> Arrays:
    """Return the columns (N,) by name. Raises UserError."""
    import pypcd4

    library: Any = pypcd4
    _check_header(Path(path), library)
    data = library.PointCloud.from_path(path).pc_data.reshape(-1)
    return {name: data[name] for name in data.dtype.names}


def _check_header(path: Path, library: Any) -> None:
    """Raise UserError if the header claims more than the file can have. It is parsed by the library itself."""
    size, lines, left = path.stat().st_size, list[str](), LONGEST
    with path.open("rb") as file:
        while len(lines) < LINES and not (lines and lines[-1].startswith("DATA")):
            line = file.readline(left)
            left -= len(line)
            if not line.endswith(b"\n"):
                raise UserError("not a readable PCD file (its header does not end)")
            text = line.decode().strip()
            if text and not text.startswith("#"):
                lines.append(text)
        try:
            header = library.MetaData.parse_header(lines)
        except Exception as error:  # pydantic's, of several lines
            raise UserError(f"not a readable PCD file ({show(' '.join(str(error).split()))[:120]})") from None
        columns = sum(header.count)
        if columns > MOST_COLUMNS:
            raise UserError(f"not a readable PCD file (COUNT: more than {MOST_COLUMNS:,} numbers a point)")
        needed = header.points * sum(bytes_ * count for bytes_, count in zip(header.size, header.count, strict=True))
        left = size - file.tell()
        if header.data.value == "binary_compressed":
            packed, unpacked = struct.unpack("<II", file.read(8).ljust(8, b"\0"))
            if packed > left - 8 or needed > unpacked:
                raise UserError(f"{CUT}: it claims more points than it holds)")
            needed = unpacked
            check_points(header.points, size)
        # A number of text takes a digit and a space.
        elif (needed if header.data.value == "binary" else 2 * columns * header.points - 1) > left:
            raise UserError(f"{CUT}: it claims more points than it holds)")
    check_claim(COPIES * needed + A_POINT * header.points, f"{header.points:,} points", size)
