"""The colors of a mesh: a texture, times a factor, times the colors of its corners."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..model.srgb import to_linear, to_srgb
from .values import CornerValues, Doubles, Integers, joined

UNREAL = "texture coordinates are not finite (NaN or infinity); repair the file, or --texture none"
"""Message about texture coordinates."""
WRAPS: dict[str, Callable[[Integers, int], Integers]] = {
    "repeat": lambda at, size: at % size,
    "clamp": lambda at, size: np.clip(at, 0, size - 1),
    "mirror": lambda at, size: np.where(at // size % 2 == 0, at % size, size - 1 - at % size),
}
"""What OpenGL does with pixels (N,) outside of an image of this size."""


@dataclass(frozen=True, eq=False)
class Picture:
    """An image, and how it continues beyond its edges."""

    pixels: NDArray[np.uint8]
    """(H, W, 3), sRGB, top row first."""
    wraps: tuple[str, str] = ("repeat", "repeat")
    """Keys of `WRAPS`, across and down."""

    def at(self, uv: Doubles) -> Doubles:
        """Sample bilinearly, as OpenGL does, at texture coordinates (N, 2), v upwards. Returns sRGB in [0, 1]."""
        height, width, _ = self.pixels.shape
        across_wrap, down_wrap = (WRAPS[name] for name in self.wraps)
        x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
        left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        across, down = (x - left)[:, None], (y - top)[:, None]

        def pixel(row: Integers, column: Integers) -> Doubles:
            return np.asarray(self.pixels[down_wrap(row, height), across_wrap(column, width)], np.float64)

        upper = pixel(top, left) * (1 - across) + pixel(top, left + 1) * across
        lower = pixel(top + 1, left) * (1 - across) + pixel(top + 1, left + 1) * across
        return np.asarray((upper * (1 - down) + lower * down) / 255)


@dataclass(frozen=True, eq=False)
class Material:
    """The colors of some faces."""

    picture: Picture | None = None
    factor: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Linear light; multiplies the picture and the colors of the corners."""


@dataclass(frozen=True, eq=False)
class Paint:
    """The colors of all faces of a mesh."""

    materials: tuple[Material, ...]
    material: NDArray[np.signedinteger]
    """(F,), index of each face's material."""
    uv: CornerValues | None = None
    """(N, 2), v upwards; None without a picture."""
    colors: CornerValues | None = None
    """(N, 3), in [0, 1]; multiply the materials."""
    linear: bool = False
    """Whether `colors` are linear light; otherwise they are sRGB."""

    def at(self, face: Integers, weights: Doubles) -> Doubles:
        """Look up colors (N, 3), sRGB in [0, 1], in faces (N,) at barycentric coordinates (N, 3, 1)."""
        painted = None if self.colors is None else self.colors.at(face, weights)
        result = np.empty((len(face), 3))
        of = self.material[face]
        order = np.argsort(of, kind="stable")
        for here in np.split(order, np.flatnonzero(np.diff(of[order])) + 1) if len(of) else ():
            shares: list[tuple[Doubles, bool]] = []  # (values, whether they are linear)
            material = self.materials[of[here[0]]]
            if material.picture is not None and self.uv is not None:
                shares.append((material.picture.at(self.uv.at(face[here], weights[here])), False))
            if material.factor != (1.0, 1.0, 1.0):
                shares.append((np.tile(material.factor, (len(here), 1)), True))
            if painted is not None:
                shares.append((painted[here], self.linear))
            result[here] = _product(shares, len(here))
        return result

    def take(self, faces: NDArray[np.bool_]) -> "Paint":
        """Keep the faces of a mask (F,)."""
        return replace(
            self,
            material=self.material[faces],
            uv=self.uv and self.uv.take(faces),
            colors=self.colors and self.colors.take(faces),
        )

    def flipped(self, faces: NDArray[np.bool_]) -> "Paint":
        """Reverse the order of the corners of the faces of a mask (F,)."""
        return replace(self, uv=self.uv and self.uv.flipped(faces), colors=self.colors and self.colors.flipped(faces))

    def words(self) -> str:
        """Say where the colors come from."""
        used = [self.materials[index] for index in np.unique(self.material)]
        sizes = {id(m.picture): m.picture.pixels.shape for m in used if m.picture is not None}
        height, width, _ = next(iter(sizes.values()), (0, 0, 0))
        words = [f"texture {width} x {height}"] if len(sizes) == 1 else [f"{len(sizes)} textures"] if sizes else []
        factors = {m.factor for m in used}
        if factors != {(1.0, 1.0, 1.0)}:
            words.append("a material's color" if len(factors) == 1 else f"colors of {len(factors)} materials")
        if self.colors is not None:
            words.append("colors of vertices")
        return " times ".join(words) or "no colors"


def _product(shares: list[tuple[Doubles, bool]], count: int) -> Doubles:
    """Multiply in linear light. Returns sRGB (N, 3)."""
    if not shares:
        return np.ones((count, 3))
    if len(shares) == 1:
        values, linear = shares[0]
        return np.clip(to_srgb(np.clip(values, 0, 1)) if linear else values, 0, 1)
    product = np.ones((count, 3))
    for values, linear in shares:
        product *= values if linear else to_linear(values)
    return np.asarray(to_srgb(np.clip(product, 0, 1)))


def joined_paint(parts: list[tuple[Paint | None, int]]) -> Paint | None:
    """Concatenate the paints of several parts of a mesh, each with its number of faces; None if none has colors.

    A part without colors is white.
    """
    if all(paint is None for paint, _ in parts):
        return None
    materials: list[Material] = []
    numbers, uvs, colors = [], [], []
    has_uv = any(paint is not None and paint.uv is not None for paint, _ in parts)
    has_colors = any(paint is not None and paint.colors is not None for paint, _ in parts)
    linear = any(paint is not None and paint.colors is not None and paint.linear for paint, _ in parts)
    for paint, count in parts:
        own = paint or Paint((Material(),), np.zeros(count, np.int64))
        numbers.append(own.material + len(materials))
        materials += own.materials
        none = np.zeros((count, 3), np.int64)
        uvs.append(own.uv or CornerValues(np.zeros((1, 2)), none))
        given = own.colors or CornerValues(np.ones((1, 3)), none)
        if linear and not own.linear:
            given = CornerValues(np.asarray(to_linear(given.values)), given.index)
        colors.append(given)
    return Paint(
        tuple(materials),
        np.concatenate(numbers),
        joined(uvs) if has_uv else None,
        joined(colors) if has_colors else None,
        linear,
    )
