"""The tiles in which a picture is drawn, and the largest picture."""

from collections.abc import Iterator

from ...model.errors import UserError

Tile = tuple[int, int, int, int]
"""A rectangle of a picture, in pixels: x and y of its lower left corner (y counts upwards), width, height."""
TILE_SIDE = 512
"""Most pixels per side of one draw: it bounds memory, a GPU watchdog's patience, and the wait for Ctrl-C."""
MAX_SIDE = 16_384
"""Most pixels per side of a picture."""


def check_size(size: tuple[int, int]) -> None:
    """Raise UserError where a picture of `size` (width, height), in pixels, cannot be drawn."""
    if not all(1 <= side <= MAX_SIDE for side in size):
        raise UserError(f"size {size[0]}x{size[1]}: each side from 1 to {MAX_SIDE} pixels")


def largest_tile(size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of the largest of the `tiles` of a picture of `size` (width, height), with its border."""
    return min(size[0], TILE_SIDE + 2), min(size[1], TILE_SIDE + 2)


def with_border(tile: Tile, size: tuple[int, int]) -> Tile:
    """Return a tile with the pixels around it that are in the picture of `size` (width, height)."""
    x, y, width, height = tile
    left, below = max(0, x - 1), max(0, y - 1)
    return left, below, min(size[0], x + width + 1) - left, min(size[1], y + height + 1) - below


def tiles(size: tuple[int, int]) -> Iterator[Tile]:
    """Yield the tiles that make up a picture of `size` (width, height), row by row from the bottom."""
    width, height = size
    for y in range(0, height, TILE_SIDE):
        for x in range(0, width, TILE_SIDE):
            yield x, y, min(TILE_SIDE, width - x), min(TILE_SIDE, height - y)
