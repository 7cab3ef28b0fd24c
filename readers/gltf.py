"""Reads glTF 2.0: all meshes of the scene in their places, with their colors.

Why not a library: trimesh honors neither required extensions nor normalized integers, skins, instances or linear
colors, and pygltflib leaves the arrays to its caller.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.srgb import to_srgb
from .clouds import EMPTY, finite_cloud
from .content import Cloud, Facts, Mesh
from .gltf_accessors import accessor, doubles, normalized
from .gltf_draco import decompressed
from .gltf_file import DAMAGED, Gltf, extension, open_gltf
from .gltf_materials import Materials, Painted
from .gltf_nodes import Placed, placed_meshes
from .images import Missing, load_picture
from .paint import Material, Paint, joined_paint
from .values import CornerValues, Doubles, Integers, joined

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
BRIGHTEST = 1.001  # colors of vertices up to this are rounded


@dataclass(frozen=True, eq=False)
class Part:
    """A primitive in its place: triangles, or points where it has no faces."""

    points: Doubles
    faces: Integers
    normals: Doubles | None
    uv: Doubles | None
    """(V, 2), v upwards; None without."""
    colors: Doubles | None
    """(V, 3), linear light; None without."""
    painted: Painted


def read_gltf(path: Path, image: Path | None, chosen: Sequence[str] | None = None) -> Mesh | Cloud:
    """Read a GLB or glTF file; without triangles, its points are a cloud. Raises UserError.

    image: replaces the images of the materials.
    """
    gltf = open_gltf(path)
    materials, parts = Materials(gltf), list[Part]()
    places = placed_meshes(gltf)
    for place in places:
        for primitive in gltf.item("meshes", place.mesh).get("primitives", []):
            parts += _part(gltf, primitive, place, materials, gltf.item("meshes", place.mesh))
    solid = [part for part in parts if len(part.faces)]
    facts = Facts(meshes=len(places))
    if any(place.joints is not None for place in places):
        facts.taken.append("in the pose of its skin")
    if not solid:
        return _cloud(parts, facts)
    facts.unwrapped = any(part.uv is not None for part in solid)
    starts = np.cumsum([0] + [len(part.points) for part in solid])
    faces = np.concatenate([part.faces + start for part, start in zip(solid, starts, strict=False)])
    normals = None
    if all(part.normals is not None for part in solid):
        normals = joined([CornerValues(part.normals, part.faces) for part in solid if part.normals is not None])
    if any(part.colors is not None and part.colors.max(initial=0) > BRIGHTEST for part in solid):
        facts.warnings.append("COLOR_0 exceeds 1, the brightest color of glTF: larger values are clipped")
    paint = _paint(solid, path, image, facts)
    return Mesh(np.concatenate([part.points for part in solid]), faces, normals, paint, facts)


def _cloud(parts: list[Part], facts: Facts) -> Cloud:
    if not parts:
        raise UserError(EMPTY)
    colors = [to_srgb(np.clip(part.colors, 0, 1)) for part in parts if part.colors is not None]
    normals = [part.normals for part in parts if part.normals is not None]
    return finite_cloud(
        np.concatenate([part.points for part in parts]),
        np.concatenate(normals) if len(normals) == len(parts) else None,
        np.concatenate(colors) if len(colors) == len(parts) else None,
        facts,
    )


def _paint(parts: list[Part], path: Path, image: Path | None, facts: Facts) -> Paint | None:
    """Return the colors of all parts; None, with a warning where there should be an image, if there are none."""
    if image is not None:
        picture = load_picture(path.parent, "", image, unwrapped=facts.unwrapped)
        parts = [Part(p.points, p.faces, p.normals, p.uv, None, Painted(Material(picture))) for p in parts]
    lost = sorted({part.painted.lost for part in parts if part.painted.lost})
    unplaced = [part for part in parts if part.painted.material.picture is not None and part.uv is None]
    bare = all((part.painted.placeholder or part in unplaced) and part.colors is None for part in parts)
    if unplaced:
        facts.warnings.append("an image is not used: its set of texture coordinates is missing")
    if lost:
        named, _, why = lost[0].rpartition(": ")
        if all(part.painted.lost for part in parts) and all(part.colors is None for part in parts):
            facts.warnings.append(Missing(named, why).line())
            return None
        facts.warnings.append(f"an image is missing: {'; '.join(lost)}")
    elif bare:
        if facts.unwrapped and not unplaced:
            facts.warnings.append(Missing("").line())
        return None
    return joined_paint([(_of_part(part), len(part.faces)) for part in parts])


def _of_part(part: Part) -> Paint:
    material = part.painted.material
    uv = None
    if material.picture is not None:
        uv = None if part.uv is None else CornerValues(part.uv, part.faces)
        material = material if uv is not None else Material(None, material.factor)
    colors = None if part.colors is None else CornerValues(part.colors, part.faces)
    return Paint((material,), np.zeros(len(part.faces), np.int64), uv, colors, linear=True)


def _part(gltf: Gltf, primitive: Any, place: Placed, materials: Materials, mesh: dict[str, Any]) -> list[Part]:
    """Read a primitive; nothing for lines. Raises UserError."""
    attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
    if not isinstance(attributes, dict) or "POSITION" not in attributes:
        return []
    mode = primitive.get("mode", TRIANGLES)
    arrays, faces = _arrays(gltf, primitive, attributes, mode)
    if mode not in (POINTS, TRIANGLES, STRIP, FAN):
        return []
    points, normals = arrays["POSITION"], arrays.get("NORMAL")
    weights = place.weights or tuple(map(float, mesh.get("weights", [])))
    for weight, target in zip(weights, primitive.get("targets", []), strict=False):
        if weight and "POSITION" in target:
            points = points + weight * doubles(gltf, target["POSITION"], 3)
        if weight and "NORMAL" in target and normals is not None:
            normals = normals + weight * doubles(gltf, target["NORMAL"], 3)
    if len(faces) and (faces.min() < 0 or faces.max() >= len(points)):
        raise UserError(f"{DAMAGED} (triangles refer to missing vertices)")
    points, normals = _moved(points, normals, place, arrays)
    if np.linalg.det(place.matrix[:3, :3]) < 0 and place.joints is None:
        faces = faces[:, ::-1]  # a mirror reverses the order of corners
    painted = materials.painted(primitive.get("material"))
    uv = arrays.get(f"TEXCOORD_{painted.coordinates}")
    if uv is not None:
        if not np.isfinite(uv).all():
            raise UserError("texture coordinates are not finite (NaN or infinity); repair the file, or --texture none")
        if painted.transform is not None:
            uv = np.concatenate((uv, np.ones((len(uv), 1))), axis=1) @ painted.transform.T
        uv = uv * (1, -1) + (0, 1)
    return [Part(points, np.ascontiguousarray(faces), normals, uv, arrays.get("COLOR_0"), painted)]


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


def _moved(
    points: Doubles, normals: Doubles | None, place: Placed, arrays: dict[str, NDArray[Any]]
) -> tuple[Doubles, Doubles | None]:
    """Move points and normals (V, 3) into the scene: by the joints of a skin, which replace the node's place."""
    matrices = place.matrix[None]
    if place.joints is not None and "JOINTS_0" in arrays and "WEIGHTS_0" in arrays:
        matrices = np.zeros((len(points), 4, 4))
        total = np.zeros(len(points))
        for k in (0, 1):
            joints, weights = arrays.get(f"JOINTS_{k}"), arrays.get(f"WEIGHTS_{k}")
            if joints is None or weights is None:
                continue
            if joints.max(initial=0) >= len(place.joints):
                raise UserError(f"{DAMAGED} (a vertex refers to a joint that does not exist)")
            for column in range(4):
                share = weights[:, column]
                matrices += share[:, None, None] * place.joints[joints[:, column].astype(np.int64)]
                total += share
        matrices /= np.where(total > 0, total, 1)[:, None, None]
        matrices[total == 0] = place.matrix
    moved = (
        np.einsum("vij,vj->vi", matrices[:, :3, :3], points) if len(matrices) > 1 else points @ matrices[0, :3, :3].T
    )
    moved = moved + matrices[:, :3, 3]
    if normals is None:
        return moved, None
    turned = np.linalg.pinv(matrices[:, :3, :3]).transpose(0, 2, 1)  # outward stays outward in a mirror
    if len(turned) > 1:
        return moved, np.einsum("vij,vj->vi", turned, normals)
    return moved, normals @ turned[0].T
