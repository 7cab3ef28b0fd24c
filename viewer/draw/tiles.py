"""The tiles of a picture, and its largest size."""

from collections.abc import Iterator

from ...model.errors import UserError

Tile = tuple[int, int, int, int]
"""A rectangle of a picture, pixels: x and y of its lower left corner (y is up), width, height."""
TILE_SIDE = 512
"""Largest side of one draw, pixels: bounds memory, the time until a GPU's watchdog, and the wait for Ctrl-C."""
MAX_SIDE = 16_384
"""Largest side of a picture, pixels."""


def check_size(size: tuple[int, int]) -> None:
    """Raise UserError unless both sides, in pixels, are from 1 to MAX_SIDE."""
    if not all(1 <= side <= MAX_SIDE for side in size):
        raise UserError(f"size {size[0]}x{size[1]}: each side from 1 to {MAX_SIDE} pixels")


def largest_tile(size: tuple[int, int]) -> tuple[int, int]:
    """Return (width, height) of the largest tile, with its border, of a picture of `size` (width, height)."""
    return min(size[0], TILE_SIDE + 2), min(size[1], TILE_SIDE + 2)


def with_border(tile: Tile, size: tuple[int, int]) -> Tile:
    """Return a tile with a border of one pixel, inside the picture of `size` (width, height)."""
    x, y, width, height = tile
    left, bottom = max(0, x - 1), max(0, y - 1)
    return left, bottom, min(size[0], x + width + 1) - left, min(size[1], y + height + 1) - bottom


def tiles(size: tuple[int, int]) -> Iterator[Tile]:
    """Yield the tiles of a picture of `size` (width, height), row by row from the bottom."""
    width, height = size
    for y in range(0, height, TILE_SIDE):
        for x in range(0, width, TILE_SIDE):
            yield x, y, min(TILE_SIDE, width - x), min(TILE_SIDE, height - y)
