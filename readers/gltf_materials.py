"""Reads the base colors of glTF materials: a factor, an image, its coordinates and their transform."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.references import MISSING, UnresolvedError
from .gltf_accessors import view_bytes
from .gltf_file import Gltf, extension
from .images import Images
from .paint import Material, Picture
from .values import Doubles

WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
KTX2 = b"\xabKTX 20\xbb"
PLACEHOLDERS = ((1.0, 1.0, 1.0), (0.8, 0.8, 0.8), (0.4, 0.4, 0.4))
"""Factors that programs write where nobody chose a color; alone they are no color of the shape."""


@dataclass(frozen=True, eq=False)
class Painted:
    """The base color of a material."""

    material: Material
    coordinates: int = 0
    """Set of texture coordinates."""
    transform: Doubles | None = None
    """(2, 3), of the coordinates (u, v, 1), v downwards; None for none."""
    lost: str = ""
    """Name of an image that is not readable, and why."""

    @property
    def placeholder(self) -> bool:
        """Whether nobody chose this color."""
        near = (tuple(round(value, 4) for value in self.material.factor),)
        return self.material.picture is None and near[0] in PLACEHOLDERS


class Materials:
    """The materials of a file, each read once."""

    def __init__(self, gltf: Gltf) -> None:
        """gltf: an open file."""
        self._gltf = gltf
        self._painted: dict[int, Painted] = {}
        self._images = Images(gltf.claims)
        self._pictures: dict[int, Picture | str] = {}

    def painted(self, index: object) -> Painted:
        """Return the color of a material; white for none. Raises UserError."""
        if not isinstance(index, int):
            return Painted(Material())
        if index not in self._painted:
            self._painted[index] = self._read(self._gltf.item("materials", index))
        return self._painted[index]

    def _read(self, described: dict[str, Any]) -> Painted:
        glossy = extension(described, "KHR_materials_pbrSpecularGlossiness")
        if glossy is not None:
            factor, texture = glossy.get("diffuseFactor"), glossy.get("diffuseTexture")
        else:
            pbr = described.get("pbrMetallicRoughness")
            pbr = pbr if isinstance(pbr, dict) else {}
            factor, texture = pbr.get("baseColorFactor"), pbr.get("baseColorTexture")
        red, green, blue = _factor(factor)
        if not isinstance(texture, dict):
            return Painted(Material(None, (red, green, blue)))
        picture = self._texture(texture.get("index"))
        changed = extension(texture, "KHR_texture_transform") or {}
        coordinates = changed.get("texCoord", texture.get("texCoord", 0)) or 0
        if isinstance(picture, str):
            return Painted(Material(None, (red, green, blue)), lost=picture)
        transform = _transform(changed) if changed else None
        return Painted(Material(picture, (red, green, blue)), int(coordinates), transform)

    def _texture(self, index: object) -> Picture | str:
        """Return the image of a texture, or its name and why it is not readable."""
        texture = self._gltf.item("textures", index)
        sampler = self._gltf.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        wraps = WRAPS.get(sampler.get("wrapS", 0), "repeat"), WRAPS.get(sampler.get("wrapT", 0), "repeat")
        others = [extension(texture, name) for name in ("EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu")]
        sources = [texture.get("source"), *(other.get("source") for other in others if other is not None)]
        reason = "a texture without an image"
        for source in sources:
            if not isinstance(source, int):
                continue
            if source not in self._pictures:
                self._pictures[source] = self._image(source)
            found = self._pictures[source]
            if isinstance(found, Picture):
                return Picture(found.pixels, wraps)
            reason = found
        return reason

    def _image(self, index: int) -> Picture | str:
        described = self._gltf.item("images", index)
        uri = described.get("uri")
        inside = not isinstance(uri, str) or uri.startswith("data:")
        name = show(str(described.get("name") or (f"image {index}" if inside else uri)))[:80]
        try:
            data = view_bytes(self._gltf, described["bufferView"]) if uri is None else self._gltf.resource(str(uri))
        except UnresolvedError as error:
            return f"{error}"
        except (UserError, KeyError):
            return f"{name}: {MISSING}"
        if data.startswith(KTX2):
            return f"{name}: a KTX2 image (KHR_texture_basisu), which is not read; store PNG or JPEG"
        picture = self._images.decoded(data)
        return f"{name}: not a readable image" if picture is None else picture


def _factor(factor: object) -> tuple[float, float, float]:
    """Return a color of linear light; white for none."""
    if isinstance(factor, list) and len(factor) >= 3 and all(isinstance(value, (int, float)) for value in factor):
        red, green, blue = (min(1.0, max(0.0, float(value))) for value in factor[:3])
        return red, green, blue
    return 1.0, 1.0, 1.0


def _transform(changed: dict[str, Any]) -> Doubles:
    """Return the matrix (2, 3) of KHR_texture_transform: scale, then turn, then move."""
    try:
        u, v = (float(value) for value in changed.get("offset", (0, 0)))
        across, down = (float(value) for value in changed.get("scale", (1, 1)))
        angle = float(changed.get("rotation", 0))
    except (TypeError, ValueError):
        return np.eye(3)[:2]
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos * across, sin * down, u], [-sin * across, cos * down, v]])
