"""Writes a small colored solid in the many ways in which programs write GLB."""

import json
import struct
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from .written_shapes import COLORS, CORNERS, QUADS, Doubles

UNSIGNED = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32}


class Glb:
    """A GLB under construction."""

    def __init__(self, gap: int = 0) -> None:
        """gap: bytes between the items of arrays, a multiple of 4."""
        self._gap, self._binary = gap, bytearray()
        self.document: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}

    def view(self, data: bytes, **more: int) -> int:
        """Add bytes to the buffer. Returns the number of their view."""
        self._binary.extend(b"\0" * (-len(self._binary) % 4))
        described = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data)} | more
        self.document["bufferViews"].append(described)
        self._binary.extend(data)
        return len(self.document["bufferViews"]) - 1

    def described(self, **more: Any) -> int:
        """Add an accessor. Returns its number."""
        self.document["accessors"].append(more)
        return len(self.document["accessors"]) - 1

    def array(self, array: NDArray[Any], kind: str, component: int, **more: Any) -> int:
        """Add an accessor of an array (N, K). Returns its number."""
        size = array.itemsize * array.shape[1]
        stride = size + self._gap + -size % 4
        rows = np.zeros((len(array), stride), np.uint8)
        rows[:, :size] = np.frombuffer(array.tobytes(), np.uint8).reshape(len(array), size)
        view = self.view(rows.tobytes(), byteStride=stride)
        return self.described(bufferView=view, type=kind, componentType=component, count=len(array), **more)

    def to_bytes(self) -> bytes:
        """Return the file."""
        self._binary.extend(b"\0" * (-len(self._binary) % 4))
        text = json.dumps(self.document | {"buffers": [{"byteLength": len(self._binary)}]}).encode()
        text += b" " * (-len(text) % 4)
        size = 28 + len(text) + len(self._binary)
        head = struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<II", len(text), 0x4E4F534A)
        return head + text + struct.pack("<II", len(self._binary), 0x004E4942) + bytes(self._binary)


def _position(glb: Glb, draw: st.DrawFn) -> tuple[int, Doubles]:
    """Add the corners: floats, normalized whole numbers, or a sparse accessor. Returns its number, and the corners."""
    corners = CORNERS / 3
    form = draw(st.sampled_from(["floats", "normalized", "sparse"]))
    if form == "floats":
        return glb.array(corners.astype("<f4"), "VEC3", 5126), corners
    if form == "normalized":
        whole = np.round(corners * 32767).astype("<i2")
        glb.document |= {name: ["KHR_mesh_quantization"] for name in ("extensionsUsed", "extensionsRequired")}
        return glb.array(whole, "VEC3", 5122, normalized=True), whole / 32767
    indices = {"bufferView": glb.view(np.arange(8, dtype=np.uint8).tobytes()), "componentType": 5121}
    values = {"bufferView": glb.view(corners.astype("<f4").tobytes())}
    sparse = {"count": 8, "indices": indices, "values": values}
    return glb.described(type="VEC3", componentType=5126, count=8, sparse=sparse), corners


def _colors(glb: Glb, draw: st.DrawFn) -> tuple[int, Doubles]:
    """Add the colors as linear light, floats or normalized. Returns their number, and the colors (8, 3)."""
    component, top = draw(st.sampled_from([(5121, 255), (5123, 65535), (5126, 1)]))
    width = draw(st.sampled_from([3, 4]))
    table = np.full((8, width), float(top))
    table[:, :3] = COLORS * top
    kept = np.round(table).astype(UNSIGNED[component]) if top > 1 else table.astype("<f4")
    more = {"normalized": True} if top > 1 else {}
    return glb.array(kept, f"VEC{width}", component, **more), kept[:, :3].astype(np.float64) / top


@st.composite
def glbs(draw: st.DrawFn) -> tuple[bytes, Doubles, Doubles | None]:
    """Draw a GLB of the solid. Returns it, its corners in the scene (8, 3), and their colors in linear light."""
    glb, colors = Glb(draw(st.sampled_from([0, 4]))), None
    position, unit = _position(glb, draw)
    primitive: dict[str, Any] = {"attributes": {"POSITION": position}}
    index = np.array([(q[0], q[i], q[i + 1]) for q in QUADS for i in (1, 2)]).ravel()
    component = draw(st.sampled_from([*UNSIGNED]))
    view = glb.view(index.astype(UNSIGNED[component]).tobytes())
    primitive["indices"] = glb.described(bufferView=view, type="SCALAR", componentType=component, count=len(index))
    if draw(st.booleans()):
        primitive["attributes"]["COLOR_0"], colors = _colors(glb, draw)
    if draw(st.booleans()):
        factor = (0.5, 0.25, 1.0)
        glb.document["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [*factor, 1.0]}}]
        primitive["material"] = 0
        colors = (np.ones((8, 3)) if colors is None else colors) * factor
    scale = np.array(draw(st.sampled_from([(1, 1, 1), (3, 3, 3), (2, 1, 3), (-1, 1, 1)])), np.float64)
    moved = np.array(draw(st.sampled_from([(0, 0, 0), (5, -7, 0.5)])), np.float64)
    node: dict[str, Any] = {"mesh": 0, "scale": scale.tolist(), "translation": moved.tolist()}
    rotation = np.eye(3)
    if draw(st.booleans()):
        node["rotation"] = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
        rotation = np.array([(0, -1, 0), (1, 0, 0), (0, 0, 1.0)])
    glb.document |= {"meshes": [{"primitives": [primitive]}], "scenes": [{"nodes": [0]}], "scene": 0}
    glb.document["nodes"] = [{"children": [1], "translation": [0, 0, 1]}, node]
    return glb.to_bytes(), (unit * scale) @ rotation.T + moved + (0, 0, 1), colors
