"""Colors of a mesh from an image and texture coordinates."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from ...model.errors import UserError
from ...model.files import show
from ...model.image_file import open_image
from .shape import Doubles

Image.MAX_IMAGE_PIXELS = 2**30
"""Pillow's limit against decompression bombs; textures of 32,768 pixels a side are legitimate."""


class ImageTexture:
    """An image with the texture coordinates of the corners of faces."""

    def __init__(self, uv: Doubles, image: NDArray[np.uint8]) -> None:
        """uv: (F, 3, 2), at the corners of faces, v upwards. image: (H, W, 3), sRGB, top row first."""
        self._uv, self._image = uv, image

    def colors(self, face: NDArray[np.int64], weights: Doubles) -> Doubles:
        """Sample the image bilinearly, repeating, as OpenGL does.

        face: (N,), indices. weights: (N, 3, 1), barycentric coordinates. Returns sRGB in [0, 1], (N, 3).
        """
        height, width, _ = self._image.shape
        u, v = (self._uv[face] * weights).sum(axis=1).T
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        across, down = (x - left)[:, None], (y - top)[:, None]

        def pixel(row: NDArray[np.int64], column: NDArray[np.int64]) -> Doubles:
            return np.asarray(self._image[row % height, column % width], np.float64)

        upper = pixel(top, left) * (1 - across) + pixel(top, left + 1) * across
        lower = pixel(top + 1, left) * (1 - across) + pixel(top + 1, left + 1) * across
        return np.asarray((upper * (1 - down) + lower * down) / 255)

    def reversed(self) -> "ImageTexture":
        """Return the texture for the same faces with the opposite order of corners."""
        return ImageTexture(self._uv[:, ::-1], self._image)


def image_texture(mesh: trimesh.Trimesh, file: Path | None) -> ImageTexture | None:
    """Return the texture of a mesh whose vertices are not merged yet; None without texture coordinates or image.

    file: an image that replaces the material's. Raises UserError for an unusable image or unusable coordinates.
    """
    visual: Any = mesh.visual
    uv = getattr(visual, "uv", None)
    if uv is None or len(uv) != len(mesh.vertices):
        if file is not None:
            raise UserError(f"--texture {show(file)}: the mesh has no texture coordinates")
        return None
    if not np.isfinite(uv).all():
        raise UserError("texture coordinates are not finite (NaN or infinity); repair the file, or --texture none")
    image = _image_of(visual.material) if file is None else open_image(file, "--texture")
    if image is None:
        return None
    if image.mode.startswith("I") or image.mode == "F":  # Pillow would clip these modes to white or black
        raise UserError("an image of 16-bit gray or of floats; save it with 8 bits a channel, or --texture none")
    return ImageTexture(np.asarray(uv, np.float64)[mesh.faces], np.asarray(image.convert("RGB"), np.uint8))


def _image_of(material: Any) -> Image.Image | None:
    """Return the image of either kind of trimesh's materials; None if it is missing or damaged."""
    image = getattr(material, "baseColorTexture", None)
    image = getattr(material, "image", None) if image is None else image
    if not isinstance(image, Image.Image):
        return None
    try:
        image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return image
