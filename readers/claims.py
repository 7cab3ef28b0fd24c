"""The memory that one file claims by numbers in it: sizes of images, counts, instances, uses of one buffer."""

from dataclasses import dataclass

from ..model.memory import check_claim


@dataclass
class Claims:
    """What a file has claimed so far."""

    at_hand: int
    """Bytes that were read: of the file, and of the files that it names."""
    taken: float = 0

    def take(self, claimed: float, what: str, meanwhile: float = 0) -> None:
        """Count memory before it is allocated. Raises UserError where the sum is more than is allowed for the bytes.

        claimed: bytes that stay. what: begins the message. meanwhile: further bytes that are freed again.
        """
        check_claim(self.taken + claimed + meanwhile, what, self.at_hand)
        self.taken += claimed
