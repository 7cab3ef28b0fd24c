"""Reads meshes with their textures and normals."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ...model.mesh_file import mesh_of_strips
from .checks import check_coordinates
from .cloud_files import Cloud, cloud_of_ply, cloud_of_vertices
from .creases import CornerNormals
from .image import ImageTexture, image_texture


@dataclass(frozen=True, eq=False)
class TexturedMesh:
    """A mesh in input space, as its file stores it."""

    mesh: trimesh.Trimesh
    texture: ImageTexture | None
    unwrapped: bool
    """Whether the mesh has texture coordinates."""
    normals: CornerNormals | None
    """The file's normals at the corners of faces; None if it has none."""


def read_mesh(path: Path, image: Path | None) -> TexturedMesh | Cloud:
    """Read an OBJ, STL or GLB; without faces, its vertices are a cloud. image: replaces the material's image."""
    try:
        mesh = trimesh.load_mesh(path, process=False)
    except OSError:  # a truncated image: load without images, which later causes a warning
        mesh = trimesh.load_mesh(path, process=False, skip_materials=True)
        if isinstance(mesh.visual, trimesh.visual.TextureVisuals):
            material: Any = trimesh.visual.material.SimpleMaterial
            mesh.visual.material = material()
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        return cloud_of_vertices(path)
    return textured(mesh, image)


def read_ply(path: Path, image: Path | None) -> TexturedMesh | Cloud:
    """Read a PLY; without faces or triangle strips, its vertices are a cloud. image: replaces the material's image."""
    loaded: Any = trimesh.load(path, process=False)
    mesh = loaded if isinstance(loaded, trimesh.Trimesh) and len(loaded.faces) else mesh_of_strips(loaded)
    if mesh is None:
        return cloud_of_ply(loaded.metadata.get("_ply_raw", {}).get("vertex", {}).get("data", {}))
    loaded.metadata.pop("_ply_raw", None)  # a second copy of the whole file
    return textured(mesh, image)


def textured(mesh: trimesh.Trimesh, image: Path | None) -> TexturedMesh:
    """Look up the texture and the normals, then merge vertices that differ only by texture coordinates or normals."""
    check_coordinates(np.asarray(mesh.vertices, np.float64))
    texture = image_texture(mesh, image)
    # trimesh computes missing normals on access; normals of the file are in its cache from the start.
    normals = None
    if "vertex_normals" in mesh._cache:
        normals = CornerNormals(np.asarray(mesh.vertex_normals, np.float64), np.array(mesh.faces))
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return TexturedMesh(mesh, texture, isinstance(mesh.visual, trimesh.visual.TextureVisuals), normals)
