"""A range coder: writes whole numbers in as many bits as their probabilities ask for (Martin 1979).

Python and the page (web/model/packed_weights.js) compute with whole numbers and with additions, products, quotients and
roots of doubles, which are the same everywhere.
"""

from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from itertools import accumulate

TOP, LEAST = 1 << 32, 1 << 24
"""The range stays from LEAST to TOP."""
TOTAL = 1 << 16
"""Largest sum of the sizes of a table."""
FINEST, COARSEST = -8, 24
"""Quarter octaves of the smallest and of the largest standard deviation of a table."""
WIDEST_BELL = COARSEST + 4 * 15
"""Quarter octaves of the largest standard deviation of a number."""
QUARTERS = (1.0, 1.189207115002721, 1.4142135623730951, 1.681792830507429)
"""2^0, 2^(1/4), 2^(1/2), 2^(3/4)."""
ESCAPE = 12
"""Bits of each half of a number that lies outside of a table."""


@dataclass(frozen=True)
class Table:
    """The probabilities of the numbers from -most to most, and then of any other."""

    most: int
    starts: list[int]
    """Sums of the sizes before each number, and of all."""


@cache
def table(quarters: int) -> Table:
    """Return the table of a bell with the standard deviation 2^(quarters / 4)."""
    deviation = power(quarters)
    most = int(4 * deviation)
    heights = []
    for number in range(most + 1):
        height = 1 - number * number / (16 * deviation * deviation)
        for _ in range(3):
            height *= height
        heights.append(height)
    total = heights[0]
    for height in heights[1:]:
        total += 2 * height
    factor = (TOTAL - 2 * most - 8) / total
    sizes = [int(height * factor) + 1 for height in heights]
    return Table(most, [0, *accumulate([*sizes[:0:-1], *sizes, 2])])


def power(quarters: int) -> float:
    """Return 2^(quarters / 4)."""
    return QUARTERS[quarters & 3] * 2.0 ** (quarters >> 2)


class Encoder:
    """Writes numbers, from the first to the last."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._low, self._range = 0, TOP - 1

    def plain(self, number: int, count: int) -> None:
        """Write one of `count` equally likely numbers from 0."""
        self._part(number, 1, count)

    def number(self, number: int, quarters: int) -> None:
        """Write a number of a bell with the standard deviation 2^(quarters / 4)."""
        shift, bell = _bell(quarters)
        high = number >> shift
        index = high + bell.most if abs(high) <= bell.most else 2 * bell.most + 1
        self._part(bell.starts[index], bell.starts[index + 1] - bell.starts[index], bell.starts[-1])
        if abs(high) > bell.most:
            wrapped = high % (1 << 2 * ESCAPE)
            self.plain(wrapped >> ESCAPE, 1 << ESCAPE)
            self.plain(wrapped % (1 << ESCAPE), 1 << ESCAPE)
        self.plain(number - (high << shift), 1 << shift)

    def finish(self) -> bytes:
        """Return the bytes."""
        return bytes(self._bytes) + self._low.to_bytes(4, "big")

    def _part(self, start: int, size: int, total: int) -> None:
        part = self._range // total
        self._low += part * start
        self._range = part * size
        if self._low >= TOP:
            self._low -= TOP
            last = len(self._bytes) - 1
            while self._bytes[last] == 255:
                self._bytes[last] = 0
                last -= 1
            self._bytes[last] += 1
        while self._range < LEAST:
            self._bytes.append(self._low >> 24)
            self._low = (self._low << 8) % TOP
            self._range <<= 8


class Decoder:
    """Reads what an Encoder wrote, and zeros after it. Raises EOFError where the bytes end too early."""

    def __init__(self, data: bytes) -> None:
        self._bytes, self._at, self._range = data, 4, TOP - 1
        if len(data) < 4:
            raise EOFError
        self._code = int.from_bytes(data[:4], "big")

    def plain(self, count: int) -> int:
        """Read one of `count` equally likely numbers from 0."""
        part = self._range // count
        number = min(self._code // part, count - 1)
        self._take(part, number, 1)
        return number

    def number(self, quarters: int) -> int:
        """Read a number of a bell with the standard deviation 2^(quarters / 4)."""
        shift, bell = _bell(quarters)
        starts = bell.starts
        part = self._range // starts[-1]
        index = bisect_right(starts, min(self._code // part, starts[-1] - 1)) - 1
        self._take(part, starts[index], starts[index + 1] - starts[index])
        high = index - bell.most
        if high > bell.most:
            high = (self.plain(1 << ESCAPE) << ESCAPE) + self.plain(1 << ESCAPE)
            if high >= 1 << 2 * ESCAPE - 1:
                high -= 1 << 2 * ESCAPE
        return high * (1 << shift) + (self.plain(1 << shift) if shift else 0)

    def finish(self) -> None:
        """Check that all was read. Raises EOFError: damaged bytes hardly ever end where the code is 0."""
        if self._code or any(self._bytes[self._at :]):
            raise EOFError

    def _take(self, part: int, start: int, size: int) -> None:
        self._code -= part * start
        self._range = part * size
        while self._range < LEAST:
            if self._at >= len(self._bytes):
                raise EOFError
            self._code = (self._code << 8) % TOP + self._bytes[self._at]
            self._at += 1
            self._range <<= 8


@cache
def _bell(quarters: int) -> tuple[int, Table]:
    """Return the number of low bits that are written as they are, and the table of the others."""
    quarters = max(FINEST, quarters)
    shift = max(0, -((COARSEST - quarters) // 4))
    return shift, table(quarters - 4 * shift)
