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
from .gltf_accessors import ARRAYS
from .gltf_file import DAMAGED, Gltf, open_gltf
from .gltf_materials import Painted
from .gltf_nodes import MOST_PLACES, Placed, placed_meshes
from .gltf_primitives import Primitive, Primitives, Weights
from .images import Missing, users_picture
from .paint import Material, Paint, joined_paint
from .values import CornerValues, Doubles, Integers, joined

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


def read_gltf(
    path: Path, image: Path | None, chosen: Sequence[str] | None = None, follow: bool = False
) -> Mesh | Cloud:
    """Read a GLB or glTF file; without triangles, its points are a cloud. Raises UserError.

    image: replaces the images of the materials. follow: of `Folder`, for buffers and images.
    """
    gltf = open_gltf(path, follow)
    places = placed_meshes(gltf)
    parts = _parts(gltf, places)
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
    paint = _paint(solid, image, facts)
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


def _paint(parts: list[Part], image: Path | None, facts: Facts) -> Paint | None:
    """Return the colors of all parts; None, with a warning where there should be an image, if there are none."""
    if image is not None:
        picture = users_picture(image, unwrapped=facts.unwrapped)
        parts = [Part(p.points, p.faces, p.normals, p.uv, None, Painted(Material(picture))) for p in parts]
    lost = sorted({part.painted.lost for part in parts if part.painted.lost})
    unplaced = [part.painted.material.picture is not None and part.uv is None for part in parts]
    pairs = zip(parts, unplaced, strict=True)
    bare = all((part.painted.placeholder or unused) and part.colors is None for part, unused in pairs)
    if any(unplaced):
        facts.warnings.append("an image is not used: its set of texture coordinates is missing")
    if lost:
        named, _, why = lost[0].rpartition(": ")
        if all(part.painted.lost for part in parts) and all(part.colors is None for part in parts):
            facts.warnings.append(Missing(named, why).line())
            return None
        facts.warnings.append(f"an image is missing: {'; '.join(lost)}")
    elif bare:
        if facts.unwrapped and not any(unplaced):
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


def _parts(gltf: Gltf, places: list[Placed]) -> list[Part]:
    """Read the primitives, and move each to its places. Raises UserError."""
    primitives, seen, count = Primitives(gltf), set[int](), 0
    for place in places:  # what all of them take, before the first is moved
        for primitive in primitives.of_mesh(place.mesh):
            count += 1
            if place.mesh in seen:
                gltf.claims.take(ARRAYS * primitive.numbers, "its instances of meshes")
        seen.add(place.mesh)
        if count > MOST_PLACES:
            raise UserError(f"more than {MOST_PLACES:,} instances of primitives; keep fewer")
    parts, own = [], {mesh: tuple(map(float, gltf.item("meshes", mesh).get("weights", []))) for mesh in seen}
    for place in places:
        weights = place.weights or own[place.mesh]
        parts += [_part(primitive, place, weights) for primitive in primitives.of_mesh(place.mesh)]
    return parts


def _part(primitive: Primitive, place: Placed, weights: Weights) -> Part:
    """Move a primitive into the scene. weights: of its morph targets. Raises UserError."""
    points, normals = _moved(*primitive.morphed(weights), place, primitive.arrays)
    faces = primitive.faces
    if np.linalg.det(place.matrix[:3, :3]) < 0 and place.joints is None:
        faces = faces[:, ::-1]  # a mirror reverses the order of corners
    colors = primitive.arrays.get("COLOR_0")
    return Part(points, np.ascontiguousarray(faces), normals, primitive.uv, colors, primitive.painted)


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
