"""A triangle mesh as a shape to train on: uniform samples and signed distances, by libigl."""

from dataclasses import replace
from typing import Any

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from .creases import CornerNormals, closed, corner_normals, face_areas, usable_normals
from .curved import curved, flat
from .far import Distances
from .image import ImageTexture
from .shape import Doubles, SurfacePoints, asked_together, normalise, unit


class MeshShape:
    """A `Shape` of triangles, or of the curved surface that they stand for, normalised.

    The sign of the distance is that of the generalised winding number (Jacobson et al. 2013), so that holes and
    intersections do no more harm than they must.
    """

    noise = 0.0
    cloud = False
    moving = False

    warnings: list[str]
    """Lines for the user."""

    def __init__(
        self,
        mesh: trimesh.Trimesh,
        name: str,
        source: dict[str, Any],
        texture: ImageTexture | None = None,
        *,
        crease: float | None = None,
        normals: CornerNormals | None = None,
        room: float = 0.0,
    ) -> None:
        """name: for people. source: for the provenance. texture: where the mesh has an image.

        crease: angle in degrees above which an edge stays sharp where all else is curved; None keeps the faces flat.
        normals: of the file, at the faces' corners; curved surfaces have these, creases included.
        room: what is left free around the mesh, as a share of its radius.
        Raises UserError where the mesh has no faces, no extent, or bounds no volume.
        """
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
        faces = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)
        if not len(vertices) or not len(faces):
            raise UserError(f"{name}: the mesh is empty; a shape needs triangles, or points with normals")
        used = _used(vertices, faces)
        if not np.ptp(used, axis=0).max() > 0:
            raise UserError(f"{name}: all vertices are one point; nothing to train on")
        _, centre, scale = normalise(used)
        vertices = (vertices - centre) / scale
        self.name, self.source = name, source
        self.warnings = []
        if _signed_volume(vertices, faces) < 0:
            faces, texture = faces[:, ::-1].copy(), None if texture is None else texture.reversed()
            normals = None if normals is None else replace(normals, index=normals.index[:, ::-1])
            self.warnings.append(f"{name}: the faces point inwards; turned round")
        if not closed(faces):
            self.warnings.append(f"{name}: the mesh is not watertight; inside is where its winding number exceeds 1/2")
        self._texture, self._colours, self._corners = texture, _vertex_colours(mesh), faces
        self.coloured = texture is not None or self._colours is not None
        self.centre, self.scale = centre, scale
        self._inputs = _used(vertices, faces)
        if crease is None:
            self._facets = flat(vertices, faces)
        else:
            self._curve(vertices, faces, _normals(vertices, faces, crease, normals))
        if room:
            self._facets = replace(self._facets, vertices=self._facets.vertices / (1 + room))
            self._inputs, self.scale = self._inputs / (1 + room), self.scale * (1 + room)
        self._areas = np.cumsum(face_areas(self._facets.vertices, self._facets.faces))
        if not self._areas[-1] > 0:
            raise UserError(f"{name}: every triangle has zero area; nothing to train on")
        self._tree, self._winding = igl.AABB(), igl.FastWindingNumberBVH()
        self._tree.init(self._facets.vertices, self._facets.faces)
        self._winding.init(self._facets.vertices, self._facets.faces)
        self._unsigned = Distances(self._tree, self._facets.vertices, self._facets.faces, self._areas)
        self._check_volume()

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw `count` points uniformly by area, with the normals of the faces, or of the curved surface.

        `held_out` changes nothing, since every call draws new points. colours: look them up as well.
        """
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)[:, :, None]
        facets = self._facets
        positions = (facets.vertices[facets.faces[face]] * weights).sum(axis=1)
        normals = unit((facets.normals[face] * weights).sum(axis=1))
        return SurfacePoints(positions, normals, self._colours_at(face, weights) if colours else None)

    def inputs(self) -> Doubles:
        """Return the mesh's vertices that faces use: (N, 3)."""
        return self._inputs

    def distance(self, points: Doubles) -> Doubles:
        """Compute the distance to the facets (`Distances`), signed by the winding number. Returns (N,)."""
        return asked_together(self._distance, points)

    def _distance(self, points: Doubles) -> Doubles:
        inside = self._winding.winding_number(points) > 0.5
        return np.asarray(np.where(inside, -1.0, 1.0) * self._unsigned(points))

    def colours_near(self, points: Doubles) -> Doubles | None:
        """Look up the colours of the surface's nearest places to points (N, 3): (N, 3); None without colours."""
        if not self.coloured or not len(points):
            return np.zeros((0, 3)) if self.coloured else None
        vertices, faces = self._facets.vertices, self._facets.faces
        _, face, closest = self._tree.squared_distance(vertices, faces, points)
        a, b, c = (np.ascontiguousarray(vertices[faces[face, k]]) for k in range(3))
        weights = igl.barycentric_coordinates(np.ascontiguousarray(closest), a, b, c)
        return self._colours_at(np.asarray(face, np.int64), np.nan_to_num(np.asarray(weights))[:, :, None])

    def _curve(self, vertices: Doubles, faces: NDArray[np.int64], normals: CornerNormals) -> None:
        """Make the facets of the curved surface; where they bulge beyond the mesh, it is normalised once more."""
        self._facets = curved(vertices, faces, normals)
        if self._facets.vertices is vertices:
            return
        vertices, centre, scale = normalise(self._facets.vertices)
        self._facets = replace(self._facets, vertices=vertices)
        self._inputs = (self._inputs - centre) / scale
        x, y, z = (float(c) for c in np.array(self.centre) + self.scale * np.array(centre))
        self.centre, self.scale = (x, y, z), self.scale * scale

    def _colours_at(self, facet: NDArray[np.int64], weights: Doubles) -> Doubles | None:
        """Look up colours at barycentric coordinates (N, 3, 1) of facets (N,). Returns (N, 3); None without colours."""
        parent = self._facets.parents[facet]
        weights = (self._facets.weights[facet] * weights).sum(axis=1)[:, :, None]
        if self._texture is not None:
            return self._texture.colours(parent, weights)
        return None if self._colours is None else (self._colours[self._corners[parent]] * weights).sum(axis=1)

    def _check_volume(self) -> None:
        """Raise UserError where no point just below the surface is inside the mesh."""
        samples = self.surface(2000, np.random.default_rng(0))
        depths = np.geomspace(1e-4, 0.3, 2000)[:, None]
        if not (self._winding.winding_number(samples.points - depths * samples.normals) > 0.5).any():
            raise UserError(
                f"{self.name}: the mesh bounds no volume (no point is inside it); give a closed surface, or --thicken T"
            )


def _signed_volume(vertices: Doubles, faces: NDArray[np.int64]) -> float:
    """Compute the volume that faces enclose; it is negative where they point inwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def _used(vertices: Doubles, faces: NDArray[np.int64]) -> Doubles:
    """Return the vertices (V, 3) that faces use: (N, 3)."""
    used = np.zeros(len(vertices), np.bool_)
    used[faces] = True
    return vertices if used.all() else vertices[used]


def _normals(vertices: Doubles, faces: NDArray[np.int64], crease: float, given: CornerNormals | None) -> CornerNormals:
    """Choose the normals at the corners of faces: those of the file, or else those between creases."""
    computed = corner_normals(vertices, faces, crease)
    return computed if given is None else usable_normals(vertices, faces, given, computed)


def _vertex_colours(mesh: trimesh.Trimesh) -> Doubles | None:
    """Return the colours of the vertices, sRGB in [0, 1], (V, 3); None where the file has none."""
    if not isinstance(mesh.visual, trimesh.visual.ColorVisuals) or mesh.visual.kind != "vertex":
        return None
    return np.asarray(mesh.visual.vertex_colors, dtype=np.float64)[:, :3] / 255
