"""The memory that one file claims by numbers in it: sizes of images, counts, instances, uses of one buffer."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from ..model.errors import UserError
from ..model.memory import check_claim

A_POINT = 200
"""Memory that a point of a cloud takes at least, as read and as converted."""
FEW_POINTS, POINTS_A_BYTE = 100_000, 2
"""Most points of a packed cloud: a number, and more for each byte of the file. Scans take a byte a point and more."""


def check_points(count: int, size: int, record: float = 0) -> None:
    """Check the number of points that a packed file of `size` bytes claims. record: bytes of each. Raises UserError."""
    if count > FEW_POINTS + POINTS_A_BYTE * size:
        raise UserError(f"it claims {count:,} points in {size:,} bytes; if it is not damaged, write it unpacked")
    check_claim(count * (record + A_POINT), f"{count:,} points", size)


@dataclass
class Claims:
    """What a file has claimed so far."""

    at_hand: int
    """Bytes that were read: of the file, and of the files that it names."""
    taken: float = 0
    _read: set[tuple[int, int]] = field(default_factory=set)
    """Files that were read, by their numbers in the system."""

    def read(self, path: Path) -> bytes:
        """Return the bytes of a file that the file names. It is at hand once, by whatever names. Raises OSError."""
        with path.open("rb") as file:
            status, data = os.fstat(file.fileno()), file.read()
        if (status.st_dev, status.st_ino) not in self._read:
            self._read.add((status.st_dev, status.st_ino))
            self.at_hand += len(data)
        return data

    def take(self, claimed: float, what: str, meanwhile: float = 0) -> None:
        """Count memory before it is allocated. Raises UserError where the sum is more than is allowed for the bytes.

        claimed: bytes that stay. what: begins the message. meanwhile: further bytes that are freed again.
        """
        check_claim(self.taken + claimed + meanwhile, what, self.at_hand)
        self.taken += claimed
