"""Reads OFF files, by trimesh."""

from pathlib import Path

from ..model.errors import UserError
from .content import Mesh


def read_off(path: Path) -> Mesh:
    """Read a mesh. Raises UserError."""
    import trimesh

    from .from_trimesh import content_of

    content = content_of(trimesh.load_scene(path, process=False))
    if not isinstance(content, Mesh):
        raise UserError("the mesh is empty; a shape needs triangles or points")
    return content
