"""Triangles of a mesh file for `eval` and the viewer, as trimesh has them (extra `mesh`)."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..model.endings import MESHES
from ..model.errors import UserError
from ..model.files import is_file, show
from .content import Mesh
from .read import read_shape
from .values import CornerValues

if TYPE_CHECKING:
    import trimesh

LARGEST = 1e30
"""Largest coordinate of a vertex: its powers are still finite."""


def load_mesh(path: Path, why: str = "", *, follow: bool = False) -> "trimesh.Trimesh":
    """Read the triangles of a mesh file unchanged, with the normals of its vertices where it has them.

    why: appended to the message about a file without triangles, for example "; ... needs a surface". follow: of
    `read_shape`. Raises UserError, which begins with the name of the file, and ModuleNotFoundError without trimesh.
    """
    label = show(path.name)
    if not is_file(path):
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in MESHES:
        raise UserError(f"{label}: not a mesh by its suffix; this program reads {' '.join(MESHES)}")
    import trimesh

    content = read_shape(path, follow=follow)
    if not isinstance(content, Mesh) or not len(content.faces):
        raise UserError(f"{label}: no triangles{why}")
    if not np.abs(content.vertices[np.unique(content.faces)]).max() <= LARGEST:
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN, infinity, huge); repair the file")
    vertices, faces, normals = content.vertices, content.faces, None
    if content.normals is not None:
        vertices, faces, normals = _split(vertices, faces, content.normals)
    return trimesh.Trimesh(vertices, faces, vertex_normals=normals, process=False)


def _split(
    vertices: np.typing.NDArray[np.float64], faces: np.typing.NDArray[np.int64], normals: CornerValues
) -> tuple[np.typing.NDArray[np.float64], np.typing.NDArray[np.int64], np.typing.NDArray[np.float64]]:
    """Return vertices, faces and normals (V, 3) so that each vertex has one normal."""
    if np.array_equal(normals.index, faces) and len(normals.values) == len(vertices):
        return vertices, faces, normals.values
    pairs, index = np.unique(faces.ravel() * len(normals.values) + normals.index.ravel(), return_inverse=True)
    own, normal = np.divmod(pairs, len(normals.values))
    return vertices[own], index.reshape(-1, 3), normals.values[normal]
