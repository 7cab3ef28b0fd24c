"""Shapes in formats of other libraries, each written by its own library: a box of 3 x 2 x 1, or a colored cloud."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from support import needs
from support.written_glb import Glb
from support.written_shapes import CORNERS, QUADS

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-1, 1, (200, 3)) * (3, 2, 1)
COLORS = RNG.integers(0, 256, (200, 3)) / 255
TRIANGLES = np.array([(q[0], q[i], q[i + 1]) for q in QUADS for i in (1, 2)])


def mesh(path: Path) -> None:
    """Write OFF or 3MF."""
    trimesh.Trimesh(CORNERS, TRIANGLES).export(path)


def pcd(path: Path, encoding: str = "BINARY_COMPRESSED") -> None:
    """Write PCD. Skips the test without pypcd4."""
    pypcd4: Any = needs.package("pypcd4")
    bits = (np.round(COLORS * 255).astype(np.uint32) << np.array([16, 8, 0], np.uint32)).sum(axis=1, dtype=np.uint32)
    columns = np.column_stack((POINTS.astype(np.float32), bits.view(np.float32)))
    pypcd4.PointCloud.from_xyzrgb_points(columns).save(path, encoding=pypcd4.Encoding[encoding])


def las(path: Path, top: int = 65535) -> None:
    """Write LAS or LAZ. top: the brightest color. Skips the test without laspy."""
    laspy: Any = needs.package("laspy")
    needs.package("lazrs")
    written = laspy.create(point_format=2)
    written.header.scales, written.header.offsets = (1e-7,) * 3, (0, 0, 0)
    written.x, written.y, written.z = POINTS.T
    written.red, written.green, written.blue = np.round(COLORS.T * top).astype(np.uint16)
    written.write(path)


def e57(path: Path) -> None:
    """Write E57. Skips the test without pye57."""
    pye57: Any = needs.package("pye57")
    file = pye57.E57(str(path), mode="w")
    colors = np.round(COLORS * 255).astype(np.uint8)
    data = {f"cartesian{axis}": POINTS[:, k] for k, axis in enumerate("XYZ")}
    file.write_scan_raw(data | {f"color{name}": colors[:, k] for k, name in enumerate(("Red", "Green", "Blue"))})
    file.close()


def draco(path: Path) -> None:
    """Write a GLB with Draco. Skips the test without DracoPy."""
    library: Any = needs.package("DracoPy")
    glb = Glb()
    data = library.encode(CORNERS.astype(np.float32), TRIANGLES.astype(np.uint32), quantization_bits=16)
    decoded = library.decode(data)
    (number,) = [each["unique_id"] for each in decoded.attributes if each["attribute_type"] == 0]
    position = glb.described(type="VEC3", componentType=5126, count=8)
    index = glb.described(type="SCALAR", componentType=5125, count=36)
    compressed = {"bufferView": glb.view(data), "attributes": {"POSITION": number}}
    extensions = {"KHR_draco_mesh_compression": compressed}
    write_scene(glb, {"attributes": {"POSITION": position}, "indices": index, "extensions": extensions}, path)


def meshopt(path: Path) -> None:
    """Write a GLB with meshopt. Skips the test without meshoptimizer."""
    library: Any = needs.package("meshoptimizer")
    glb = Glb()
    views = []
    vertices = library.encode_vertex_buffer(CORNERS.astype(np.float32), 8, 12)
    indices = library.encode_index_buffer(TRIANGLES.astype(np.uint32).ravel(), 36, 8)
    for packed, stride, mode, count in ((vertices, 12, "ATTRIBUTES", 8), (indices, 4, "TRIANGLES", 36)):
        data = bytes(packed)
        view = glb.view(data)
        described = glb.document["bufferViews"][view]
        described["extensions"] = {
            "EXT_meshopt_compression": {
                "buffer": 0,
                "byteOffset": described["byteOffset"],
                "byteLength": len(data),
                "byteStride": stride,
                "mode": mode,
                "count": count,
            }
        }
        views.append(view)
    position = glb.described(bufferView=views[0], type="VEC3", componentType=5126, count=8)
    index = glb.described(bufferView=views[1], type="SCALAR", componentType=5125, count=36)
    write_scene(glb, {"attributes": {"POSITION": position}, "indices": index}, path)


def write_scene(glb: Glb, primitive: dict[str, Any], path: Path) -> None:
    """Write a GLB of one primitive."""
    glb.document |= {"meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    path.write_bytes(glb.to_bytes())


WRITERS: dict[str, Callable[[Path], None]] = {
    "a.off": mesh,
    "a.3mf": mesh,
    "a.pcd": pcd,
    "a.las": las,
    "a.laz": las,
    "a.e57": e57,
    "draco.glb": draco,
    "meshopt.glb": meshopt,
}
"""Name of a file -> its writer."""
