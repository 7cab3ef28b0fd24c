"""Conversion of a mesh to a PLY, OBJ, STL or GLB file, by trimesh."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.kinds import MARK
from ..model.orientation import DEFAULT_UP, as_in_file
from ..model.srgb import Values, to_linear
from .surface import Mesh

OPTIONS: dict[str, dict[str, Any]] = {
    ".ply": {"vertex_normal": True},
    ".obj": {"include_normals": True, "include_color": True},
    ".stl": {},
    ".glb": {"include_normals": True},
}
"""Suffix of an output format -> options of trimesh's writer. STL holds triangles alone."""
FINE, COARSE = 1e-6, 1e-5
"""Rounding steps, in radii of the shape: PLY has doubles above the first; STL and GLB warn above the second."""
SINGLE = (".stl", ".glb")
"""Formats without doubles."""
FORMAT = b"format binary_little_endian 1.0\n"
MARKED = FORMAT + f"comment {MARK}\n".encode()
"""Second line of a PLY, without and with the mark that mplicits wrote it."""


def check_suffix(path: Path) -> None:
    """Raise UserError if the suffix of a file is no output format."""
    if path.suffix.lower() not in OPTIONS:
        raise UserError(f"{show(path)}: a mesh is written as {', '.join(OPTIONS)}")


def to_bytes(mesh: Mesh, suffix: str, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP) -> bytes:
    """Convert a mesh to the bytes of a file, with vertices in input space. center, scale, up: `Model.place`.

    suffix: a key of OPTIONS. Colors are sRGB, but linear in a GLB, as glTF prescribes.
    """
    written = as_trimesh(mesh, center, scale, up, linear=suffix == ".glb")
    if suffix == ".ply" and rounding(written.vertices, scale) > FINE:
        return _double_ply(written, mesh.normals is not None, mesh.colors is not None)
    # Decimals of an OBJ, so that a small shape keeps its digits, too.
    more: dict[str, Any] = {"digits": max(8, 7 - math.floor(math.log10(scale)))} if suffix == ".obj" else {}
    data = written.export(file_type=suffix[1:], **OPTIONS[suffix], **more)
    content = data.encode() if isinstance(data, str) else bytes(data)
    return content.replace(FORMAT, MARKED, 1) if suffix == ".ply" else content


def rounding(vertices: NDArray[np.float64], scale: float) -> float:
    """Return the rounding step of float32 at the largest coordinate of vertices (V, 3), in radii of the shape."""
    return float(np.spacing(np.float32(np.abs(vertices).max(initial=0.0)))) / scale


def rounding_warning(vertices: NDArray[np.float64], scale: float, suffix: str) -> str:
    """Return a warning where a format rounds the vertices (V, 3) visibly, which names the remedy; else ""."""
    step = rounding(vertices, scale)
    if suffix not in SINGLE or step <= COARSE:
        return ""
    return (
        f"{suffix[1:].upper()} stores coordinates as large as {np.abs(vertices).max():.3g} in steps of {step:.1g} of "
        "the shape's radius; PLY and OBJ keep them, and --space model leaves the place out"
    )


def _double_ply(mesh: trimesh.Trimesh, normals: bool, colors: bool) -> bytes:
    """Write a PLY whose coordinates are doubles. normals, colors: whether to write those of the vertices."""
    columns: list[tuple[str, str, NDArray[Any]]] = [
        (name, "f8", column) for name, column in zip("xyz", mesh.vertices.T, strict=True)
    ]
    if normals:
        columns += [(f"n{name}", "f4", column) for name, column in zip("xyz", mesh.vertex_normals.T, strict=True)]
    if colors:
        visual: Any = mesh.visual
        rgb = np.asarray(visual.vertex_colors)[:, :3].T
        columns += [(name, "u1", column) for name, column in zip(("red", "green", "blue"), rgb, strict=True)]
    vertices = np.empty(len(mesh.vertices), [(name, "<" + kind) for name, kind, _ in columns])
    for name, _, column in columns:
        vertices[name] = column
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.faces
    words = {"f8": "double", "f4": "float", "u1": "uchar"}
    lines = ["ply", *MARKED.decode().splitlines(), f"element vertex {len(vertices)}"]
    lines += [f"property {words[kind]} {name}" for name, kind, _ in columns]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(lines).encode() + vertices.tobytes() + faces.tobytes()


def as_trimesh(
    mesh: Mesh, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP, linear: bool = False
) -> trimesh.Trimesh:
    """Convert a mesh to trimesh, with vertices in input space. linear: colors in linear light."""
    colors = None
    if mesh.colors is not None:
        colors = _bytes(to_linear(mesh.colors) if linear else mesh.colors)
    return trimesh.Trimesh(
        as_in_file(mesh.vertices.astype(np.float64) * scale + center, up),
        mesh.faces,
        vertex_normals=None if mesh.normals is None else as_in_file(mesh.normals.astype(np.float64), up),
        vertex_colors=colors,
        process=False,
    )


def _bytes(colors: Values) -> NDArray[np.uint8]:
    """Convert colors in [0, 1] to bytes."""
    return np.round(np.clip(colors, 0, 1) * 255).astype(np.uint8)
