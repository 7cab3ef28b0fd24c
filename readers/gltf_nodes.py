"""Walks the nodes of a glTF scene: where each mesh stands, its instances, and the pose of its skin."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..model.errors import UserError
from .gltf_accessors import doubles
from .gltf_file import DAMAGED, Gltf, extension
from .values import Doubles

DEEPEST = 1000  # levels of nodes
MOST_PLACES = 100_000  # instances of all meshes
MATRIX = 500  # bytes of a joint's matrix, while it is made


@dataclass(frozen=True, eq=False)
class Placed:
    """A mesh in the scene."""

    mesh: int
    matrix: Doubles
    """(4, 4), from the mesh to the scene."""
    joints: Doubles | None
    """(J, 4, 4), of the mesh's skin, from the mesh to the scene; None without a skin."""
    weights: tuple[float, ...] | None
    """Of the mesh's morph targets, where the node has them."""


def placed_meshes(gltf: Gltf) -> list[Placed]:
    """List the meshes of the scene, with all instances. Raises UserError."""
    world = _world(gltf)
    skins = _Skins(gltf, world)
    found: list[Placed] = []
    for index, matrix in world.items():
        node = gltf.item("nodes", index)
        if not isinstance(mesh := node.get("mesh"), int):
            continue
        weights = node.get("weights")
        morph = tuple(map(float, weights)) if isinstance(weights, list) else None
        joints = skins.joints(node["skin"]) if "skin" in node else None
        for instance in _instances(gltf, node):
            found.append(Placed(mesh, matrix @ instance, joints, morph))
            if len(found) > MOST_PLACES:
                raise UserError(f"more than {MOST_PLACES:,} instances of meshes; keep fewer")
    return found


def _world(gltf: Gltf) -> dict[int, Doubles]:
    """Return node -> its matrix to the scene, for the visible nodes of the scene. Raises UserError."""
    nodes, scenes = gltf.items("nodes"), gltf.items("scenes")
    if scenes:
        scene = gltf.item("scenes", gltf.document.get("scene", 0))
        roots = scene.get("nodes", [])
        start = extension(gltf.document, "CESIUM_RTC") or {}
    else:
        children = {child for node in nodes if isinstance(node, dict) for child in node.get("children", [])}
        roots, start = [k for k in range(len(nodes)) if k not in children], {}
    base = np.eye(4)
    if isinstance(center := start.get("center"), list) and len(center) == 3:
        base[:3, 3] = center
    found: dict[int, Doubles] = {}
    pending = [(root, base, 0) for root in reversed(roots)]
    while pending:
        index, above, depth = pending.pop()
        node = gltf.item("nodes", index)
        if index in found or depth > DEEPEST:
            raise UserError(f"{DAMAGED} (node {index} is its own parent, or has two)")
        if (extension(node, "KHR_node_visibility") or {}).get("visible", True) is False:
            continue
        found[index] = above @ _local(node)
        pending += [(child, found[index], depth + 1) for child in reversed(node.get("children", []))]
    return found


def _all_nodes(gltf: Gltf, world: Mapping[int, Doubles]) -> dict[int, Doubles]:
    """Return node -> its matrix, also for joints outside of the scene."""
    found = dict(world)
    parents = {child: k for k, node in enumerate(gltf.items("nodes")) for child in node.get("children", [])}
    for index in range(len(gltf.items("nodes"))):
        chain = [index]
        while chain[-1] not in found and chain[-1] in parents and len(chain) <= DEEPEST:
            chain.append(parents[chain[-1]])
        matrix = found.get(chain[-1], np.eye(4) @ _local(gltf.item("nodes", chain[-1])))
        found.setdefault(chain[-1], matrix)
        for node in reversed(chain[:-1]):
            matrix = found[node] = matrix @ _local(gltf.item("nodes", node))
    return found


def _local(node: Mapping[str, Any]) -> Doubles:
    """Return the matrix (4, 4) of a node to its parent. Raises UserError."""
    try:
        if "matrix" in node:
            return np.asarray(np.array(node["matrix"], np.float64).reshape(4, 4).T)
        return np.asarray(
            _matrix(
                np.array(node.get("translation", (0, 0, 0)), np.float64).reshape(1, 3),
                np.array(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(1, 4),
                np.array(node.get("scale", (1, 1, 1)), np.float64).reshape(1, 3),
            )[0]
        )
    except (TypeError, ValueError):
        raise UserError(f"{DAMAGED} (a node's place)") from None


def _matrix(translation: Doubles, rotation: Doubles, scale: Doubles) -> Doubles:
    """Return matrices (N, 4, 4) of translations (N, 3), quaternions x y z w (N, 4) and scales (N, 3)."""
    lengths = np.linalg.norm(rotation, axis=1, keepdims=True)
    x, y, z, w = (rotation / np.where(lengths > 0, lengths, 1)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    result = np.tile(np.eye(4), (len(rotation), 1, 1))
    result[:, :3, :3] = np.moveaxis(np.array(rows), 2, 0) * scale[:, None, :]
    result[:, :3, 3] = translation
    return result


def _instances(gltf: Gltf, node: Mapping[str, Any]) -> Iterator[Doubles]:
    """Yield the matrix of each instance of a node: EXT_mesh_gpu_instancing, or one."""
    found = extension(node, "EXT_mesh_gpu_instancing")
    attributes = found.get("attributes") if found is not None else None
    if not isinstance(attributes, dict):
        yield np.eye(4)
        return
    parts = {
        name: doubles(gltf, attributes[name], width)
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
        if name in attributes
    }
    count = max((len(part) for part in parts.values()), default=1)
    if any(len(part) != count for part in parts.values()):
        raise UserError(f"{DAMAGED} (the attributes of instances differ in number)")
    yield from _matrix(
        parts.get("TRANSLATION", np.zeros((count, 3))),
        parts.get("ROTATION", np.tile([0.0, 0, 0, 1], (count, 1))),
        parts.get("SCALE", np.ones((count, 3))),
    )


class _Skins:
    """The skins of a file, each read once."""

    def __init__(self, gltf: Gltf, world: Mapping[int, Doubles]) -> None:
        """world: of `_world`."""
        self._gltf, self._world = gltf, world
        self._found: dict[int, Doubles] = {}

    @cached_property
    def _nodes(self) -> dict[int, Doubles]:
        return _all_nodes(self._gltf, self._world)

    def joints(self, skin: object) -> Doubles:
        """Return the matrices (J, 4, 4) of a skin's joints, from the mesh to the scene. Raises UserError."""
        described = self._gltf.item("skins", skin)
        assert isinstance(skin, int)
        if skin not in self._found:
            self._found[skin] = self._read(described)
        return self._found[skin]

    def _read(self, described: Mapping[str, Any]) -> Doubles:
        joints = described.get("joints", [])
        if not joints or any(joint not in self._nodes for joint in joints):
            raise UserError(f"{DAMAGED} (a skin has joints that do not exist)")
        self._gltf.claims.take(MATRIX * len(joints), "the joints of its skins")
        places = np.stack([self._nodes[joint] for joint in joints])
        if "inverseBindMatrices" not in described:
            return places
        inverse = doubles(self._gltf, described["inverseBindMatrices"], 16).reshape(-1, 4, 4).transpose(0, 2, 1)
        if len(inverse) < len(places):
            raise UserError(f"{DAMAGED} (a skin has fewer matrices than joints)")
        return np.asarray(places @ inverse[: len(places)])
