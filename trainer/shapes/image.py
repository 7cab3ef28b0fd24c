"""Colours of a mesh from an image and texture coordinates."""

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
"""A texture of 32,768 pixels a side is large, not an attack."""


class ImageTexture:
    """An image, and the texture coordinates of the corners of faces."""

    def __init__(self, uv: Doubles, image: NDArray[np.uint8]) -> None:
        """uv: (F, 3, 2), of the faces' corners, v upwards. image: (H, W, 3), sRGB, top row first."""
        self._uv, self._image = uv, image

    def colours(self, face: NDArray[np.int64], weights: Doubles) -> Doubles:
        """Sample the image, bilinear and repeating as in OpenGL.

        face: (N,), indices. weights: (N, 3, 1), barycentric, of the faces' corners. Returns sRGB in [0, 1], (N, 3).
        """
        height, width, _ = self._image.shape
        u, v = (self._uv[face] * weights).sum(axis=1).T
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        right_share, low_share = (x - left)[:, None], (y - top)[:, None]

        def pixel(row: NDArray[np.int64], column: NDArray[np.int64]) -> Doubles:
            return np.asarray(self._image[row % height, column % width], np.float64)

        upper = pixel(top, left) * (1 - right_share) + pixel(top, left + 1) * right_share
        lower = pixel(top + 1, left) * (1 - right_share) + pixel(top + 1, left + 1) * right_share
        return np.asarray((upper * (1 - low_share) + lower * low_share) / 255)

    def reversed(self) -> "ImageTexture":
        """Make the texture for the same faces with their corners in the opposite order."""
        return ImageTexture(self._uv[:, ::-1], self._image)


def image_texture(mesh: trimesh.Trimesh, file: Path | None) -> ImageTexture | None:
    """Return the texture of a mesh whose vertices are not merged yet; None where it has none.

    file: an image in place of the material's. Raises UserError where an image or the coordinates cannot be used.
    """
    visual: Any = mesh.visual
    uv = getattr(visual, "uv", None)
    if uv is None or len(uv) != len(mesh.vertices):
        if file is not None:
            raise UserError(f"--texture {show(file)}: the mesh has no texture coordinates to put an image by")
        return None
    if not np.isfinite(uv).all():
        raise UserError("texture coordinates that are not finite (NaN or infinity); repair the file, or --texture none")
    image = _of_material(visual.material) if file is None else open_image(file, "--texture")
    if image is None:
        return None
    if image.mode.startswith("I") or image.mode == "F":  # Pillow's conversion would clip them to white or black
        raise UserError("an image of 16-bit grey or of floats; save it with 8 bits a channel, or --texture none")
    return ImageTexture(np.asarray(uv, np.float64)[mesh.faces], np.asarray(image.convert("RGB"), np.uint8))


def _of_material(material: Any) -> Image.Image | None:
    """Return the image of a material of trimesh, of either kind; None where it has none, or a damaged one."""
    image = getattr(material, "baseColorTexture", None)
    image = getattr(material, "image", None) if image is None else image
    if not isinstance(image, Image.Image):
        return None
    try:
        image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return image
