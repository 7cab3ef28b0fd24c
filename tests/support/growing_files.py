"""Files of shapes that grow with a number: each repeats what a reader may do once too often."""

import base64
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
SOLID = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def png(side: int) -> bytes:
    """Return a black picture of one bit a pixel, which is small at any size."""
    data = io.BytesIO()
    Image.new("1", (side, side)).save(data, "png", optimize=True)
    return data.getvalue()


def gltf(path: Path, more: dict[str, Any]) -> Path:
    """Write a glTF of one mesh, a triangle. more: replaces parts of the document."""
    data = np.eye(3, dtype="<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "data:;base64," + base64.b64encode(data).decode(), "byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
    }
    path.write_text(json.dumps(document | more))
    return path


def blank_lines(folder: Path, count: int) -> Path:
    """An STL text with blank lines before its only triangle."""
    corners = "\n".join(f"vertex {x} {y} 0" for x, y in ((0, 0), (1, 0), (0, 1)))
    path = folder / "blank.stl"
    path.write_text(
        "solid\n" + "\n" * count + f"facet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\nendsolid"
    )
    return path


def libraries(folder: Path, count: int) -> Path:
    """An OBJ that names one long file of materials in many lines."""
    (folder / "long.mtl").write_text("newmtl a\nKd 1 0 0\n" * 20)
    path = folder / "libraries.obj"
    path.write_text("mtllib long.mtl\n" * count + TRIANGLE + "usemtl a\nf 1/1 2/2 3/3\n")
    return path


def materials(folder: Path, count: int) -> Path:
    """An OBJ of many materials that share one image, each scaled, and each used once."""
    (folder / "one.png").write_bytes(png(256))
    lines = (f"newmtl m{k}\nmap_Kd -s 2 2 1 one.png\n" for k in range(count))
    (folder / "materials.mtl").write_text("".join(lines))
    path = folder / "materials.obj"
    faces = "".join(f"usemtl m{k}\nf 1/1 2/2 3/3\n" for k in range(count))
    path.write_text("mtllib materials.mtl\n" + TRIANGLE + faces + "f 1 2 3\n")
    return path


def polygon(folder: Path, count: int) -> Path:
    """An OBJ of one polygon: a star of many rays."""
    angle = np.arange(count) * 2 * np.pi / count
    radius = 1 + 0.5 * np.random.default_rng(0).random(count)
    lines = [f"v {x:.9f} {y:.9f} 0" for x, y in zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)]
    path = folder / "polygon.obj"
    path.write_text("\n".join(lines) + "\nf " + " ".join(map(str, range(1, count + 1))) + "\n")
    return path


def polygon_sizes(folder: Path, count: int) -> Path:
    """An OBJ of triangles, and of one polygon of every size."""
    corners = [" ".join("123"[k % 3] for k in range(size)) for size in range(3, int(count**0.5))]
    path = folder / "sizes.obj"
    path.write_text(TRIANGLE + "".join(f"f {each}\n" for each in corners) + "f 1 2 3\n" * count)
    return path


def strips(folder: Path, count: int) -> Path:
    """A PLY of many strips of three vertices."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element tristrips {count}\nproperty list uchar uchar vertex_indices\nend_header\n"
    path = folder / "strips.ply"
    path.write_bytes(head.encode() + np.eye(3, dtype="<f4").tobytes() + b"\3\0\1\2" * (count - 1) + b"\4\0\1\2\0")
    return path


def skins(folder: Path, count: int) -> Path:
    """A glTF of many nodes that share a skin."""
    nodes = [{"mesh": 0, "skin": 0}] * count
    return gltf(folder / "skins.gltf", {"nodes": nodes, "skins": [{"joints": [0, 1]}]})


def nodes(folder: Path, count: int) -> Path:
    """A glTF of many nodes that share a mesh of two primitives."""
    primitive = {"attributes": {"POSITION": 0}}
    return gltf(folder / "nodes.gltf", {"nodes": [{"mesh": 0}] * count, "meshes": [{"primitives": [primitive] * 2}]})


def weights(folder: Path, count: int) -> Path:
    """A glTF of many nodes that share a mesh, and a mesh of many primitives; each with many weights."""
    each, primitive = [1.0] * (count // 2), {"attributes": {"POSITION": 0}}
    meshes = [{"weights": each, "primitives": [primitive]}, {"primitives": [primitive] * (count // 2)}]
    nodes = [*[{"mesh": 0}] * (count // 2), {"mesh": 1, "weights": each}]
    return gltf(folder / "weights.gltf", {"nodes": nodes, "meshes": meshes})


def chain(folder: Path, count: int) -> Path:
    """A glTF of a skin whose joints are a chain of many nodes outside of the scene."""
    chained = [{"mesh": 0, "skin": 0}, *({"children": [k + 2]} for k in range(count)), {}]
    skin = {"joints": [*range(1, count)]}
    return gltf(folder / "chain.gltf", {"nodes": chained, "scenes": [{"nodes": [0]}], "skins": [skin]})


def uncolored(folder: Path, count: int) -> Path:
    """A glTF of many primitives with an image, and without texture coordinates."""
    uri = "data:image/png;base64," + base64.b64encode(png(64)).decode()
    image = {"images": [{"uri": uri}], "textures": [{"source": 0}]}
    painted = {"materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}] * count}
    primitives = [{"attributes": {"POSITION": 0}, "material": k} for k in range(count)]
    return gltf(folder / "uncolored.gltf", image | painted | {"meshes": [{"primitives": primitives}]})


def table(folder: Path, count: int) -> Path:
    """A CSV of many short rows after one with more columns."""
    path = folder / "table.csv"
    path.write_text("1,2,3,4,5,6\n" + "1,2,3,4,5,6\n" * count + "1,2,3\n")
    return path


FILES: dict[str, tuple[Callable[[Path, int], Path], int]] = {
    "blank lines": (blank_lines, 300_000),
    "libraries": (libraries, 20_000),
    "materials": (materials, 2_000),
    "polygon": (polygon, 1_000),
    "polygon sizes": (polygon_sizes, 40_000),
    "strips": (strips, 40_000),
    "skins": (skins, 1_000),
    "nodes": (nodes, 1_000),
    "weights": (weights, 2_000),
    "chain": (chain, 2_000),
    "uncolored": (uncolored, 1_000),
    "table": (table, 10_000),
}
"""Name -> the writer of a file, and the smaller of the two numbers that are compared."""
