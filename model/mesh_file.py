"""Triangle meshes from files, read by trimesh (extra `mesh`) and checked."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .files import show

if TYPE_CHECKING:
    import trimesh

SUFFIXES = (".ply", ".obj", ".stl", ".glb")
"""Suffixes of mesh files, in lower case."""
LARGEST = 1e30
"""Largest coordinate of a vertex: its powers are still finite."""
LONGEST_HEADER = 65_536
"""Largest length in bytes of the header of a PLY."""


def load_mesh(path: Path, why: str = "") -> "trimesh.Trimesh":
    """Read the triangles of a PLY, OBJ, STL or GLB file unchanged, with the normals of a PLY or OBJ.

    why: appended to the message about a file without triangles, for example "; ... needs a surface". Raises UserError,
    which begins with the name of the file, and ModuleNotFoundError without trimesh.
    """
    label = show(path.name)
    if not os.path.isfile(path):
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{label}: not a mesh by its suffix; this program reads {' '.join(SUFFIXES)}")
    import trimesh

    try:
        mesh = trimesh.load(path, process=False)
        if isinstance(mesh, trimesh.Scene):  # load(force="mesh") would drop the normals of other files.
            mesh = mesh.to_mesh()
        if isinstance(mesh, trimesh.PointCloud):
            mesh = mesh_of_strips(mesh) or mesh
    except Exception as error:  # On damaged files, readers of trimesh raise exceptions of all types.
        # ImportError: trimesh tried to guess the encoding of a binary file.
        text = "" if isinstance(error, ImportError) else str(error)
        reason = show(text.splitlines()[0] if text else "damaged")[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise UserError(f"{label}: no triangles{why}")
    if mesh.vertices.ndim != 2 or mesh.vertices.shape[1] != 3:
        raise UserError(f"{label}: vertices of {mesh.vertices.shape[-1]} coordinates; three are needed")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise UserError(f"{label}: triangles refer to missing vertices; repair the file")
    if not np.abs(mesh.vertices[mesh.referenced_vertices]).max() <= LARGEST:
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN, infinity, huge); repair the file")
    return mesh


def mesh_of_strips(loaded: Any) -> "trimesh.Trimesh | None":
    """Convert the triangle strips of a PLY to a mesh; None without strips. Old scans have strips instead of faces.

    loaded: trimesh's point cloud of the PLY. Each triangle of a strip shares two vertices with the previous one; a
    negative number starts a new strip.
    """
    import trimesh

    raw = loaded.metadata.get("_ply_raw", {})
    strips = [strip for row in _rows(raw.get("tristrips", {}).get("data")) for strip in _parted(row)]
    if not strips:
        return None
    faces = trimesh.util.triangle_strips_to_faces(strips)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # Strips repeat a vertex to change direction.
    columns = raw["vertex"]["data"]
    names = set(columns.dtype.names if isinstance(columns, np.ndarray) else columns)

    def stack(*keys: str) -> NDArray[Any] | None:
        return np.stack([np.asarray(columns[key]).reshape(-1) for key in keys], axis=1) if names >= set(keys) else None

    return trimesh.Trimesh(
        stack("x", "y", "z"),
        faces,
        vertex_normals=stack("nx", "ny", "nz"),
        vertex_colors=stack("red", "green", "blue"),
        process=False,
    )


def _rows(data: Any) -> list[NDArray[np.int64]]:
    """Return the lists of an element with a single list property, from trimesh's data of an ASCII or binary file."""
    if data is None:
        return []
    names = data.dtype.names if isinstance(data, np.ndarray) else list(data)
    column = data[names[0]]
    if getattr(column, "dtype", None) is not None and column.dtype.names:
        column = column[column.dtype.names[-1]]  # The first field is the length.
    return [np.asarray(row, np.int64).ravel() for row in column]


def _parted(row: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Split a list at negative numbers into strips of at least three vertices."""
    ends = np.flatnonzero(row < 0)
    return [strip[strip >= 0] for strip in np.split(row, ends) if (strip >= 0).sum() >= 3]


def mesh_files(path: Path) -> list[Path]:
    """List the files that `load_mesh` reads: the mesh, the materials of an OBJ, and their images."""
    files = [path]
    if path.suffix.lower() == ".obj":
        files += (library := _named(path, rb"mtllib"))
        files += [image for material in library for image in _named(material, rb"map_\w+")]
    elif path.suffix.lower() == ".ply":
        files += _named(path, rb"comment[ \t]+TextureFile", LONGEST_HEADER)
    return files


def _named(path: Path, keyword: bytes, length: int = -1) -> list[Path]:
    """List the files that lines with a keyword name, in the first `length` bytes. Options before a name are skipped."""
    try:
        with path.open("rb") as file:
            content = file.read(length) if path.is_file() else b""
    except OSError:
        return []
    values = re.findall(rb"^[ \t]*" + keyword + rb"[ \t]+(\S[^\r\n]*)", content, re.MULTILINE)
    names = [value.split()[-1] if value.startswith(b"-") else value.rstrip() for value in values]
    return [path.parent / os.fsdecode(name) for name in names if b"\0" not in name]
