"""Reads NumPy's archives of named arrays."""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

from numpy.lib import format as npy
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.memory import check_claim
from .claims import check_points
from .clouds import content_of_arrays
from .content import Cloud, Mesh
from .zip_file import members

COPIES, DOUBLE = 3, 8  # of the arrays, until they are a shape, and bytes of what they become


def read_npz(path: Path, chosen: Sequence[str] | None = None) -> Cloud | Mesh:
    """Read named arrays. Raises UserError."""
    with zipfile.ZipFile(path) as archive:
        found = content_of_arrays(Members(archive, path.stat().st_size), chosen)
    if isinstance(found, Cloud):
        check_points(len(found.points), path.stat().st_size)
    return found


class Members(Mapping[str, NDArray[Any]]):
    """The arrays of an archive by name, each read when it is asked for; none is unpickled."""

    def __init__(self, archive: zipfile.ZipFile, size: int) -> None:
        self._archive, self._size, self._taken = archive, size, 0
        self._members = {info.filename.removesuffix(".npy"): info for info in members(archive)}

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def __getitem__(self, name: str) -> NDArray[Any]:
        info = self._members[name]
        with self._archive.open(info) as file:
            version = npy.read_magic(file)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, kind = read(file)
        if prod(shape) * kind.itemsize > info.file_size or min(shape, default=0) < 0:
            raise UserError(f"array `{show(name)[:60]}` is cut off: it claims {prod(shape):,} numbers")
        self._taken += prod(shape) * max(kind.itemsize, DOUBLE)
        check_claim(COPIES * self._taken, f"{prod(shape):,} numbers in `{show(name)[:60]}`", self._size)
        with self._archive.open(info) as file:
            return npy.read_array(file, allow_pickle=False)
