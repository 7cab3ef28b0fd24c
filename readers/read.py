"""Reads a file of a shape by its ending."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ..model.errors import UserError
from ..model.files import is_file, is_folder, reason_of, show
from .content import Cloud, Mesh
from .e57 import read_e57
from .gltf import read_gltf
from .las import read_las
from .npz import read_npz
from .obj import read_obj
from .off import read_off
from .pcd import read_pcd
from .ply import read_ply
from .stl import read_stl
from .text_clouds import read_text
from .threemf import read_3mf

Reader = Callable[[Path, Path | None, Sequence[str] | None, bool], Mesh | Cloud]
"""Reads a path; the second argument replaces the image of a material, the third names the columns of points.

The fourth is `Folder.follow`, for the files that the path's file names.
"""


def _points(read: Callable[[Path, Sequence[str] | None], Mesh | Cloud]) -> Reader:
    """Return a reader of a format without texture coordinates."""
    return lambda path, _, chosen, __: read(path, chosen)


def _triangles(read: Callable[[Path], Mesh]) -> Reader:
    return lambda path, *_: read(path)


READERS: dict[str, Reader] = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".stl": _triangles(read_stl),
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".off": _triangles(read_off),
    ".3mf": _triangles(read_3mf),
    **dict.fromkeys((".xyz", ".csv", ".txt", ".asc", ".pts"), _points(read_text)),
    ".npz": _points(read_npz),
    ".pcd": _points(read_pcd),
    **dict.fromkeys((".las", ".laz"), _points(read_las)),
    ".e57": _points(read_e57),
}
"""Ending of a file, in lower case -> its reader."""


def read_shape(
    path: Path, image: Path | None = None, chosen: Sequence[str] | None = None, *, follow: bool = False
) -> Mesh | Cloud:
    """Read a mesh or a point cloud. Raises UserError, which begins with the file's name.

    image: replaces the image of the mesh's material. chosen: roles of the columns of points (`parse_columns`). follow:
    whether the file may name files outside of its folder. Raises ModuleNotFoundError where a package for the format is
    missing.
    """
    label = show(path.name)
    if is_folder(path):
        raise UserError(f"{show(path)}: a folder, not a file")
    if not is_file(path):
        raise UserError(f"{show(path)}: no such file")
    read = READERS.get(path.suffix.lower())
    if read is None:
        raise UserError(f"{label}: unknown shape format; this program reads {known_formats()}")
    try:
        content = read(path, image, chosen, follow)
    except UserError as error:
        raise UserError(f"{label}: {error}") from None
    except (ModuleNotFoundError, MemoryError):
        raise
    except Exception as error:  # libraries raise anything on damaged files
        text = str(error).splitlines()
        reason = show(text[0] if text else type(error).__name__)[:160]
        damaged = f"not a readable {path.suffix[1:].upper()} file ({reason})"
        raise UserError(f"{label}: {reason_of(error, damaged)}") from None
    if image is not None and isinstance(content, Cloud):
        raise UserError(f"{label}: --texture {show(image)}: a point cloud has no texture coordinates")
    if image is not None and not content_has_picture(content):
        raise UserError(f"{label}: --texture {show(image)}: the mesh has no texture coordinates")
    return content


def content_has_picture(content: Mesh | Cloud) -> bool:
    """Whether a mesh has an image."""
    paint = content.paint if isinstance(content, Mesh) else None
    return paint is not None and any(material.picture is not None for material in paint.materials)


def known_formats() -> str:
    """List the formats, for messages."""
    return " ".join(suffix[1:].upper() for suffix in READERS)
