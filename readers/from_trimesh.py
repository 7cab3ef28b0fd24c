"""Converts meshes, point clouds and scenes of trimesh."""

from typing import Any

import numpy as np
import trimesh

from ..model.errors import UserError
from .clouds import EMPTY, finite_cloud
from .content import Cloud, Facts, Mesh
from .images import Missing, picture_of
from .paint import UNREAL, Material, Paint, joined_paint
from .values import CornerValues, joined


def content_of(geometry: Any) -> Mesh | Cloud:
    """Convert a trimesh.Trimesh, PointCloud or Scene. Raises UserError."""
    if isinstance(geometry, trimesh.Scene):
        return _of_scene(geometry)
    if isinstance(geometry, trimesh.PointCloud):
        colors = np.asarray(geometry.colors, np.float64)
        colored = colors.shape[:1] == (len(geometry.vertices),) and colors.ndim == 2 and colors.shape[1] >= 3
        points = np.asarray(geometry.vertices, np.float64)
        return finite_cloud(points, None, colors[:, :3] / 255 if colored else None, Facts())
    if isinstance(geometry, trimesh.Trimesh):
        return of_mesh(geometry)
    raise UserError(EMPTY)


def of_mesh(mesh: trimesh.Trimesh) -> Mesh:
    """Convert a mesh, with the colors of its visual. Raises UserError."""
    faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    facts = Facts()
    # trimesh computes missing normals on access; normals of the file are in its cache from the start.
    normals = None
    if "vertex_normals" in mesh._cache:
        normals = CornerValues(np.asarray(mesh.vertex_normals, np.float64), faces)
    paint = _paint(mesh.visual, faces, len(mesh.vertices), facts)
    return Mesh(np.asarray(mesh.vertices, np.float64), faces, normals, paint, facts)


def _of_scene(scene: Any) -> Mesh | Cloud:
    """Join the geometry of a scene, each in its place."""
    meshes, clouds = [], []
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[name]
        moved = scene.geometry[geometry].copy()
        moved.apply_transform(matrix)
        if isinstance(moved, trimesh.Trimesh) and len(moved.faces):
            meshes.append(of_mesh(moved))
        elif isinstance(moved, trimesh.PointCloud):
            clouds.append(moved)
    if not meshes:
        if len(clouds) != 1:
            raise UserError(EMPTY)
        return content_of(clouds[0])
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    warnings = [line for mesh in meshes for line in mesh.facts.warnings]
    paint = joined_paint([(mesh.paint, len(mesh.faces)) for mesh in meshes])
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
        joined(normals) if len(normals) == len(meshes) else None,
        paint,
        Facts(len(meshes), any(mesh.facts.unwrapped for mesh in meshes), warnings=[*dict.fromkeys(warnings)]),
    )


def _paint(visual: Any, faces: Any, vertices: int, facts: Facts) -> Paint | None:
    """Return the colors of vertices, of faces, or of an image; None without."""
    whole = np.zeros(len(faces), np.int64)
    if isinstance(visual, trimesh.visual.TextureVisuals):
        uv = visual.uv
        material: Any = visual.material
        image = getattr(material, "baseColorTexture", None)
        image = getattr(material, "image", None) if image is None else image
        facts.unwrapped = uv is not None and len(uv) == vertices
        if facts.unwrapped and not np.isfinite(uv).all():
            raise UserError(UNREAL)
        if facts.unwrapped and image is not None:
            return Paint((Material(picture_of(image)),), whole, CornerValues(np.asarray(uv, np.float64)[:, :2], faces))
        if facts.unwrapped:
            facts.warnings.append(Missing("").line())
        factor = getattr(material, "baseColorFactor", None)
        if factor is None:
            return None
        rgb = np.asarray(factor, np.float64)[:3]
        rgb = rgb / 255 if np.asarray(factor).dtype.kind in "iu" or rgb.max() > 1 else rgb
        red, green, blue = (float(value) for value in rgb)
        return Paint((Material(None, (red, green, blue)),), whole)
    if getattr(visual, "kind", None) == "vertex":
        colors = np.asarray(visual.vertex_colors, np.float64)[:, :3] / 255
        return Paint((Material(),), whole, colors=CornerValues(colors, faces))
    if getattr(visual, "kind", None) == "face":
        colors = np.asarray(visual.face_colors, np.float64)[:, :3] / 255
        return Paint(
            (Material(),), whole, colors=CornerValues(colors, np.repeat(np.arange(len(faces)), 3).reshape(-1, 3))
        )
    return None
