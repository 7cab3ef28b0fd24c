"""A triangle mesh as a shape to train on: uniform samples and exact signed distances, by libigl."""

from dataclasses import replace
from typing import Any

import igl
import numpy as np
import trimesh

from ...model.errors import UserError
from .image import ImageTexture
from .shape import Doubles, SurfacePoints, normalise, unit


class MeshShape:
    """A `Shape` of triangles, normalised.

    The sign of the distance is that of the generalised winding number (Jacobson et al. 2013), so that holes and
    intersections do no more harm than they must.
    """

    resolution = 0.0

    warnings: list[str]
    """Lines for the user."""

    def __init__(
        self, mesh: trimesh.Trimesh, name: str, source: dict[str, Any], texture: ImageTexture | None = None
    ) -> None:
        """name: for people. source: for the provenance. texture: where the mesh has an image.

        Raises UserError where the mesh has no faces, no extent, or bounds no volume.
        """
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
        faces = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)
        if not len(vertices) or not len(faces):
            raise UserError(f"{name}: the mesh is empty; a shape needs triangles, or points with normals")
        used = vertices[np.unique(faces)]
        if not np.ptp(used, axis=0).max() > 0:
            raise UserError(f"{name}: all vertices are one point; nothing to train on")
        _, self.centre, self.scale = normalise(used)
        self.name, self.source = name, source
        self.warnings = []
        self._vertices = (vertices - self.centre) / self.scale
        self._faces = faces
        self._texture, self._colours = texture, _vertex_colours(mesh)
        self.coloured = texture is not None or self._colours is not None
        self._orient()
        self._tree, self._winding = igl.AABB(), igl.FastWindingNumberBVH()
        self._tree.init(self._vertices, self._faces)
        self._winding.init(self._vertices, self._faces)
        self._check_volume()
        if not mesh.is_watertight:
            self.warnings.append(f"{name}: the mesh is not watertight; inside is where its winding number exceeds 1/2")

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw `count` points uniformly by area, with the normals of the faces.

        `held_out` changes nothing, since every call draws new points. colours: look them up as well.
        """
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)[:, :, None]
        corners = self._faces[face]
        points = SurfacePoints((self._vertices[corners] * weights).sum(axis=1), self._normals[face])
        if not colours or not self.coloured:
            return points
        if self._texture is not None:
            return replace(points, colours=self._texture.colours(face, weights))
        assert self._colours is not None
        return replace(points, colours=(self._colours[corners] * weights).sum(axis=1))

    def inputs(self) -> Doubles:
        """Return the vertices that faces use: (N, 3)."""
        return self._vertices[np.unique(self._faces)]

    def distance(self, points: Doubles) -> Doubles:
        """Compute the exact distance, signed by the winding number. Returns (N,)."""
        inside = self._winding.winding_number(points) > 0.5
        return np.where(inside, -1.0, 1.0) * self.clearance(points)

    def clearance(self, points: Doubles) -> Doubles:
        """Compute the exact distance without its sign. Returns (N,)."""
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sqrt(squared))

    def _orient(self) -> None:
        """Turn the faces round where the signed volume is negative; store the normals and the running sum of areas."""
        corners = self._vertices[self._faces]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        if volume < 0:
            self._faces = self._faces[:, ::-1].copy()
            self._texture = None if self._texture is None else self._texture.reversed()
            self.warnings.append(f"{self.name}: the faces point inwards; turned round")
            corners = corners[:, ::-1]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._areas = np.cumsum(np.linalg.norm(cross, axis=1) / 2)
        self._normals = unit(cross)
        if not self._areas[-1] > 0:
            raise UserError(f"{self.name}: every triangle has zero area; nothing to train on")

    def _check_volume(self) -> None:
        """Raise UserError where no point just below the surface is inside the mesh."""
        samples = self.surface(2000, np.random.default_rng(0))
        depths = np.geomspace(1e-4, 0.3, 2000)[:, None]
        if not (self._winding.winding_number(samples.points - depths * samples.normals) > 0.5).any():
            raise UserError(f"{self.name}: the mesh bounds no volume (no point is inside it); give a closed surface")


def _vertex_colours(mesh: trimesh.Trimesh) -> Doubles | None:
    """Return the colours of the vertices, sRGB in [0, 1], (V, 3); None where the file has none."""
    if not isinstance(mesh.visual, trimesh.visual.ColorVisuals) or mesh.visual.kind != "vertex":
        return None
    return np.asarray(mesh.visual.vertex_colors, dtype=np.float64)[:, :3] / 255
