"""The memory that one file claims by numbers in it: sizes of images, counts, instances, uses of one buffer."""

from dataclasses import dataclass

from ..model.memory import check_claim

PROPORTION = 64
"""Bytes of memory for each byte of a file that need no check: unpacked images, numbers as doubles, and copies."""


@dataclass
class Claims:
    """What a file has claimed so far."""

    at_hand: int
    """Bytes that were read: of the file, and of the files that it names."""
    taken: float = 0

    def take(self, claimed: float, what: str, meanwhile: float = 0) -> None:
        """Count memory before it is allocated. Raises UserError where the sum is beyond the budget and the bytes.

        claimed: bytes that stay. what: begins the message. meanwhile: further bytes that are freed again.
        """
        check_claim(self.taken + claimed + meanwhile - PROPORTION * self.at_hand, what)
        self.taken += claimed
