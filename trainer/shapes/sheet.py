"""An open sheet as a shape: the solid of all points that are nearer to it than a thickness."""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from .creases import CornerNormals, closed
from .image import ImageTexture
from .mesh import MeshShape
from .shape import Doubles, SurfacePoints

REACH = 3.0
"""How far from the sheet points are thrown that are then moved to the surface, in thicknesses.

The rim, which is half a tube, gets half as many points for its area as the sides do; thrown less far, it gets fewer.
"""
SHORT = 1e-3
"""A point whose distance is smaller than the thickness by a larger share is no point of the surface."""
ROUNDS = 100
"""Most rounds in which points are thrown."""
INPUTS = 20_000
"""Points of the surface that stand for the input's own, which lie inside of it."""


class SheetShape(MeshShape):
    """A `Shape` whose distance is that to a mesh with a boundary, less a thickness T: 2 T thick, with round rims."""

    def __init__(
        self,
        mesh: trimesh.Trimesh,
        name: str,
        source: dict[str, Any],
        texture: ImageTexture | None = None,
        *,
        thickness: float,
        crease: float | None = None,
        normals: CornerNormals | None = None,
    ) -> None:
        """thickness: T, as a share of the sheet's radius. See `MeshShape` for the rest.

        Raises UserError where the mesh is closed, too.
        """
        if closed(np.asarray(mesh.faces, np.int64)):
            raise UserError(f"{name}: --thicken is for open sheets; this mesh is closed")
        source = source | {"thicken": thickness}
        super().__init__(mesh, name, source, texture, crease=crease, normals=normals, room=thickness)
        self.thickness = thickness / (1 + thickness)
        self.warnings = []  # A sheet need not be closed.
        self._inputs = self.surface(INPUTS, np.random.default_rng(0)).points

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw `count` points of the surface around the sheet. `held_out` changes nothing.

        Points are thrown around the sheet, and moved along the line to their nearest point of it.
        """
        parts: list[tuple[Doubles, Doubles]] = []
        looked_up: list[Doubles] = []
        missing = count
        for _ in range(ROUNDS):
            start = super().surface(max(missing, 64), rng).points
            away = rng.normal(size=start.shape)
            away /= np.linalg.norm(away, axis=1, keepdims=True)
            face, nearest = self._nearest(start + REACH * self.thickness * away)
            out = start + REACH * self.thickness * away - nearest
            length = np.linalg.norm(out, axis=1)
            normals = out / np.maximum(length, 1e-12)[:, None]
            points = nearest + self.thickness * normals
            good = (length > 1e-9) & (self._unsigned(points) > self.thickness * (1 - SHORT))
            good[np.flatnonzero(good)[missing:]] = False
            parts.append((points[good], normals[good]))
            if colours and self.coloured:
                looked_up.append(self._colours_near(face[good], nearest[good]))
            missing -= len(parts[-1][0])
            if not missing:
                points, normals = (np.concatenate(column) for column in zip(*parts, strict=True))
                return SurfacePoints(points, normals, np.concatenate(looked_up) if looked_up else None)
        raise UserError(f"{self.name}: --thicken: hardly any surface is left around this sheet; try another thickness")

    def distance(self, points: Doubles) -> Doubles:
        """Compute the distance to the sheet less the thickness. Returns (N,)."""
        return self._unsigned(points) - self.thickness

    def _nearest(self, points: Doubles) -> tuple[NDArray[np.int64], Doubles]:
        """Find the nearest facet to points (N, 3), and the place on it: (N,) and (N, 3)."""
        _, facet, place = self._tree.squared_distance(self._facets.vertices, self._facets.faces, points)
        return np.asarray(facet, np.int64), np.asarray(place)

    def _colours_near(self, facet: NDArray[np.int64], places: Doubles) -> Doubles:
        corners = self._facets.vertices[self._facets.faces[facet]]
        barycentric: Any = trimesh.triangles.points_to_barycentric
        weights = barycentric(corners, places)
        found = self._colours_at(facet, np.clip(np.nan_to_num(weights), 0, 1)[:, :, None])
        assert found is not None
        return found

    def _check_volume(self) -> None:
        """Ask for no volume: a sheet bounds none."""
