"""A triangle mesh as a shape to train on."""

import time
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from typing import Any

import igl
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ...model.errors import UserError
from ...readers.content import Mesh
from ...readers.values import CornerValues
from .creases import closed, corner_normals, crease_length, face_areas, usable_normals
from .curved import curved, flat
from .mesh_distance import MeshDistance
from .parts import facing, facing_warnings
from .reading_report import ReadingReport
from .shape import Doubles, SurfacePoints, as_triple, in_cell_order, normalize, unit

SHALLOW = 1e-3  # depth below the surface, model units, at which an open mesh is asked what it encloses
ENCLOSED = 0.65  # least winding number of what an open mesh encloses; that of a flat sheet is 1/2
LEAST_ENCLOSED = 0.25
"""An open mesh of which a smaller share has something enclosed below it is a sheet: terrain, a leaf."""
PATIENCE, FIRST = 1.5, 16
"""Seconds of the processor for all winding numbers of a check, and points of the first part.

A mesh that crosses itself everywhere takes 0.1 microseconds for each face and point; others take 2 for a point.
"""


class MeshShape:
    """A `Shape` of triangles, or of their curved surface, in model space.

    The sign of the distance is that of the generalized winding number (Jacobson et al. 2013), which tolerates holes
    and intersections.
    """

    noise = 0.0
    cloud = False
    moving = False
    taken: ReadingReport | None = None

    open: bool
    """Whether the surface has a boundary."""
    warnings: list[str]
    """Lines for the user."""
    creases: float
    """Length of the edges that stay sharp in the curved surface, in radii."""

    def __init__(
        self,
        mesh: Mesh,
        name: str,
        source: dict[str, Any],
        *,
        crease: float | None = None,
        margin: float = 0.0,
    ) -> None:
        """mesh: without vertices at one place (`tidy`). name: in messages. source: for the provenance.

        crease: least angle, degrees, of an edge that stays sharp in the curved surface, which uses the mesh's normals;
        None: flat faces. margin: free space around the mesh, as a share of its radius.
        Raises UserError if the mesh has no faces, no extent, or encloses no volume.
        """
        vertices, faces = mesh.vertices, mesh.faces
        if not len(vertices) or not len(faces):
            raise UserError(f"{name}: the mesh is empty; a shape needs triangles, or points with normals")
        used = _used(vertices, faces)
        if not np.ptp(used, axis=0).max() > 0:
            raise UserError(f"{name}: all vertices are one point; nothing to train on")
        _, center, scale = normalize(used)
        vertices = (vertices - center) / scale
        self.name, self.source = name, source
        self.facing = facing(vertices, faces)
        self.warnings = [f"{name}: {line}" for line in facing_warnings(self.facing)]
        if self.facing.flipped.any():
            mesh = mesh.flipped(self.facing.flipped)
            faces = mesh.faces
        self.open = not closed(faces)
        if self.open:
            self.warnings.append(f"{name}: the mesh is not watertight; inside is where its winding number exceeds 1/2")
        self._paint, self._corners = mesh.paint, faces
        self.colored = mesh.paint is not None
        self.center, self.scale = center, scale
        self._inputs, self._vertices, self._curved = _used(vertices, faces), vertices, crease is not None
        self.creases = 0.0
        if crease is None:
            self._facets = flat(vertices, faces)
        else:
            computed = corner_normals(vertices, faces, crease)
            given = mesh.normals
            normals = computed if given is None else usable_normals(vertices, faces, given, computed)
            self.creases = crease_length(vertices, faces, normals)
            self._curve(vertices, faces, normals)
        if margin:
            self._facets = replace(self._facets, vertices=self._facets.vertices / (1 + margin))
            self._inputs, self._vertices = self._inputs / (1 + margin), self._vertices / (1 + margin)
            self.scale *= 1 + margin
        self._index()
        self._check_volume()

    def _index(self) -> None:
        """Prepare the facets for samples and distances. Raises UserError if they have no area."""
        self._areas = np.cumsum(face_areas(self._facets.vertices, self._facets.faces))
        if not self._areas[-1] > 0:
            raise UserError(f"{self.name}: every triangle has zero area; nothing to train on")
        self._tree, self._winding = igl.AABB(), igl.FastWindingNumberBVH()
        self._tree.init(self._facets.vertices, self._facets.faces)
        self._winding.init(self._facets.vertices, self._facets.faces)
        self._unsigned = MeshDistance(self._tree, self._facets.vertices, self._facets.faces, self._areas)

    def with_flat_faces(self) -> "MeshShape | None":
        """Return the shape of the file's flat faces in the same space; None where the faces are not curved."""
        if not self._curved:
            return None
        flattened = copy(self)
        flattened._facets = flat(self._vertices, self._corners)
        if len(flattened._facets.faces) != len(self._facets.faces):  # Otherwise only the normals differ.
            flattened._index()
        return flattened

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw `count` points uniformly by area, with the normals of the faces or of the curved surface."""
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)[:, :, None]
        facets = self._facets
        positions = (facets.vertices[facets.faces[face]] * weights).sum(axis=1)
        normals = unit((facets.normals[face] * weights).sum(axis=1))
        return SurfacePoints(positions, normals, self._colors_at(face, weights) if colors else None)

    def inputs(self) -> Doubles:
        """Return the vertices of the mesh's faces, (N, 3)."""
        return self._inputs

    def distance(self, points: Doubles) -> Doubles:
        """Compute the distance (N,) to the facets (`MeshDistance`), signed by the winding number."""
        return in_cell_order(self._distance, points)

    def _distance(self, points: Doubles) -> Doubles:
        inside = self._winding.winding_number(points) > 0.5
        return np.asarray(np.where(inside, -1.0, 1.0) * self._unsigned(points))

    def colors_near(self, points: Doubles) -> Doubles | None:
        """Look up the colors (N, 3) of the surface points nearest to points (N, 3); None without colors."""
        if not self.colored or not len(points):
            return np.zeros((0, 3)) if self.colored else None
        vertices, faces = self._facets.vertices, self._facets.faces
        _, face, closest = self._tree.squared_distance(vertices, faces, points)
        a, b, c = (np.ascontiguousarray(vertices[faces[face, k]]) for k in range(3))
        weights = igl.barycentric_coordinates(np.ascontiguousarray(closest), a, b, c)
        return self._colors_at(np.asarray(face, np.int64), np.nan_to_num(np.asarray(weights))[:, :, None])

    def _curve(self, vertices: Doubles, faces: NDArray[np.int64], normals: CornerValues) -> None:
        """Set the facets of the curved surface, and normalize again if they bulge beyond the mesh."""
        self._facets = curved(vertices, faces, normals)
        if self._facets.vertices is vertices:
            return
        vertices, center, scale = normalize(self._facets.vertices)
        self._facets = replace(self._facets, vertices=vertices)
        self._inputs, self._vertices = (self._inputs - center) / scale, (self._vertices - center) / scale
        self.center = as_triple(np.array(self.center) + self.scale * np.array(center))
        self.scale *= scale

    def _colors_at(self, facet: NDArray[np.int64], weights: Doubles) -> Doubles | None:
        """Look up colors (N, 3) at barycentric coordinates (N, 3, 1) of facets (N,); None without colors."""
        parent = self._facets.parents[facet]
        weights = (self._facets.weights[facet] * weights).sum(axis=1)[:, :, None]
        return None if self._paint is None else self._paint.at(parent, weights)

    def _check_volume(self) -> None:
        """Raise UserError if nothing, or of an open surface next to nothing, is inside the mesh."""
        samples = self.surface(400, np.random.default_rng(0))
        depths = np.geomspace(1e-4, 0.3, 400)[:, None, None]
        deep = (samples.points - depths * samples.normals).reshape(-1, 3)
        deep = np.random.default_rng(1).permutation(deep)
        if not any((numbers > 0.5).any() for numbers in self._winding_numbers(deep)):
            raise UserError(f"{self.name}: the mesh encloses no volume; use a closed surface, or --thicken T")
        below = samples.points - SHALLOW * samples.normals
        if self.open and np.mean(np.concatenate([*self._winding_numbers(below)]) > ENCLOSED) < LEAST_ENCLOSED:
            raise UserError(
                f"{self.name}: the mesh is an open sheet, which encloses next to nothing; use a closed surface, or "
                "--thicken T"
            )

    def _winding_numbers(self, points: Doubles) -> Iterator[Doubles]:
        """Yield the winding numbers of points (N, 3) in random order, in ever larger parts, for some `PATIENCE`."""
        ends, start, size = time.process_time() + PATIENCE, 0, FIRST
        while start < len(points) and time.process_time() < ends:
            yield np.asarray(self._winding.winding_number(points[start : start + size]))
            start, size = start + size, 2 * size


def _used(vertices: Doubles, faces: NDArray[np.int64]) -> Doubles:
    """Select the vertices (N, 3) that faces refer to."""
    used = np.zeros(len(vertices), np.bool_)
    used[faces] = True
    return vertices if used.all() else vertices[used]
