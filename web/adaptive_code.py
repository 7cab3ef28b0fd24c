"""An adaptive arithmetic code for whole numbers, which tiny/draw.js reads.

A number is a path through a binary tree. Each node of a tree counts its zeros and ones so far; their share is the
probability of the next bit. The interval of a bit is split as in the coder of Witten, Neal and Cleary (1987), with
bytes shifted out as soon as they are known.
"""

from collections.abc import Iterable

TOP = 0xFFFFFFFF
"""Largest number of the interval."""
START = 2
"""Count of each bit at a node before the first."""


class Encoder:
    """Writes whole numbers."""

    def __init__(self) -> None:
        self._low, self._high, self._bytes = 0, TOP, bytearray()

    def numbers(self, values: Iterable[int], half: int) -> None:
        """Write numbers from -half to half, whose frequencies are learned from one another. half 0: write nothing."""
        bits = (2 * half).bit_length()
        counts: dict[int, list[int]] = {}
        for value in values:
            node = 1
            for place in reversed(range(bits)):
                bit = (value + half) >> place & 1
                self._bit(bit, counts.setdefault(node, [START, START]))
                node = 2 * node + bit

    def finish(self) -> bytes:
        """Return the code. Readers take zeros for the bytes after its end."""
        if self._low:  # The interval has numbers with a higher first byte, which ends in zeros.
            self._bytes.append((self._low >> 24) + 1)
        return bytes(self._bytes)

    def _bit(self, bit: int, counts: list[int]) -> None:
        middle = self._low + int((self._high - self._low) * (counts[0] / (counts[0] + counts[1])))
        if bit:
            self._low = middle + 1
        else:
            self._high = middle
        counts[bit] += 1
        while self._low >> 24 == self._high >> 24:
            self._bytes.append(self._low >> 24)
            self._low, self._high = self._low << 8 & TOP, (self._high << 8 & TOP) | 255
