"""Reads the primitives of glTF meshes: attributes, triangles, morph targets; each once, for all of its nodes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .gltf_accessors import accessor, doubles, normalized
from .gltf_draco import decompressed
from .gltf_file import DAMAGED, Gltf, extension
from .gltf_materials import Materials, Painted
from .paint import UNREAL
from .values import Doubles, Integers

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6

Weights = tuple[float, ...]
Moved = tuple[Doubles, Doubles | None]
"""Points and normals (V, 3)."""


@dataclass(frozen=True, eq=False)
class Primitive:
    """A primitive as the file has it: triangles, or points where it has no faces."""

    arrays: dict[str, NDArray[Any]]
    """Attributes (V, K) by name; those of texture coordinates are in `uv`."""
    faces: Integers
    """(F, 3), indices of vertices."""
    uv: Doubles | None
    """(V, 2), v upwards; None without."""
    painted: Painted
    target: Callable[[int, str], Doubles | None]
    """Returns what a morph target, by its number, adds to an attribute (V, 3)."""
    targets: int = 0
    """How many morph targets it has."""
    _morphed: dict[int, tuple[Weights, Moved]] = field(default_factory=dict, repr=False)
    """By the identity of the weights, which all instances of a node share: to compare them would take as long."""

    @property
    def numbers(self) -> int:
        """How many numbers a place of it takes."""
        return self.faces.size + sum(array.size for array in self.arrays.values())

    def morphed(self, weights: Weights) -> Moved:
        """Return points and normals (V, 3) with the weights of the morph targets; for one object of weights, once."""
        if id(weights) not in self._morphed:
            self._morphed[id(weights)] = weights, self._with(weights)
        return self._morphed[id(weights)][1]

    def _with(self, weights: Weights) -> Moved:
        found: list[Doubles | None] = []
        for name in ("POSITION", "NORMAL"):
            values = self.arrays.get(name)
            for number, weight in enumerate(weights[: self.targets]):
                if weight and values is not None and (moved := self.target(number, name)) is not None:
                    values = values + weight * moved
            found.append(values)
        points, normals = found
        assert points is not None
        return points, normals


class Primitives:
    """The primitives of a file, each read once."""

    def __init__(self, gltf: Gltf) -> None:
        """gltf: an open file."""
        self._gltf, self._materials = gltf, Materials(gltf)
        self._found: dict[int, list[Primitive]] = {}

    def of_mesh(self, index: int) -> list[Primitive]:
        """Return the primitives of a mesh, without lines. Raises UserError."""
        if index not in self._found:
            listed = self._gltf.item("meshes", index).get("primitives", [])
            found = (self._read(each) for each in listed if isinstance(each, dict))
            self._found[index] = [each for each in found if each is not None]
        return self._found[index]

    def _read(self, described: dict[str, Any]) -> Primitive | None:
        attributes = described.get("attributes")
        mode = described.get("mode", TRIANGLES)
        if not isinstance(attributes, dict) or "POSITION" not in attributes:
            return None
        arrays, faces = _arrays(self._gltf, described, attributes, mode)
        if mode not in (POINTS, TRIANGLES, STRIP, FAN):
            return None
        count = len(arrays["POSITION"])
        if len(faces) and (faces.min() < 0 or faces.max() >= count):
            raise UserError(f"{DAMAGED} (triangles refer to missing vertices)")
        painted = self._materials.painted(described.get("material"))
        uv = arrays.get(f"TEXCOORD_{painted.coordinates}")
        if uv is not None:
            if not np.isfinite(uv).all():
                raise UserError(UNREAL)
            if painted.transform is not None:
                uv = np.concatenate((uv, np.ones((len(uv), 1))), axis=1) @ painted.transform.T
            uv = uv * (1, -1) + (0, 1)
        targets = described.get("targets", [])

        @cache
        def target(number: int, name: str) -> Doubles | None:
            if name not in targets[number]:
                return None
            values = doubles(self._gltf, targets[number][name], 3)
            if len(values) != count:
                raise UserError(f"{DAMAGED} (a morph target has {len(values)} of {count} vertices)")
            return values

        return Primitive(arrays, faces, uv, painted, target, len(targets))


def _arrays(
    gltf: Gltf, primitive: dict[str, Any], attributes: dict[str, Any], mode: int
) -> tuple[dict[str, NDArray[Any]], Integers]:
    """Read the attributes that are used, and the triangles (F, 3)."""
    compressed = extension(primitive, "KHR_draco_mesh_compression")
    found: dict[str, NDArray[Any]] = {}
    index: NDArray[Any] | None = None
    if compressed is not None:
        found, index = decompressed(gltf, compressed, attributes)
    widths = {"POSITION": 3, "NORMAL": 3, "COLOR_0": 3, "JOINTS_0": 4, "WEIGHTS_0": 4, "JOINTS_1": 4, "WEIGHTS_1": 4}
    widths |= {name: 2 for name in attributes if name.startswith("TEXCOORD_")}
    for name, width in widths.items():
        if name not in attributes:
            continue
        values = found[name] if name in found else accessor(gltf, attributes[name])
        if name.startswith(("COLOR", "WEIGHTS")):
            values = normalized(values)  # some programs leave out the word
        if len(values.shape) < 2 or values.shape[1] < width:
            raise UserError(f"{DAMAGED} ({name} has {values.shape[-1]} numbers a vertex)")
        found[name] = values[:, :width].astype(np.float64)
    count = len(found["POSITION"])
    if any(len(values) != count for values in found.values()):
        raise UserError(f"{DAMAGED} (attributes of a mesh differ in number)")
    if index is None:
        index = accessor(gltf, primitive["indices"])[:, 0] if "indices" in primitive else np.arange(count)
    return found, _triangles(index.reshape(-1).astype(np.int64), mode)


def _triangles(index: Integers, mode: int) -> Integers:
    """Return the triangles (F, 3) of indices of vertices."""
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3 or mode not in (STRIP, FAN):
        return np.zeros((0, 3), np.int64)
    if mode == FAN:
        return np.stack((np.full(len(index) - 2, index[0]), index[1:-1], index[2:]), axis=1)
    rows = np.stack((index[:-2], index[1:-1], index[2:]), axis=1)
    rows[1::2] = rows[1::2, [1, 0, 2]]
    return rows
