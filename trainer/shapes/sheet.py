"""An open mesh as a shape: the solid of all points within a distance of the sheet."""

from typing import Any

import numpy as np
import trimesh
from numpy.random import Generator
from numpy.typing import NDArray

from ...model.errors import UserError
from ...readers.content import Mesh
from .creases import closed
from .mesh import MeshShape
from .shape import Doubles, SurfacePoints, joined

REACH = 3.0
"""Distance, in thicknesses, from the sheet to the random points that are projected onto the solid's surface.

For its area, the rim (half a tube) receives half as many samples as the sides; a smaller reach gives it fewer.
"""
SHORT = 1e-3
"""A projected point is rejected if its distance to the sheet is smaller than the thickness by a larger share."""
ROUNDS = 100  # most rounds of sampling
INPUTS = 20_000  # samples that `inputs` returns, since the mesh's own vertices are inside the solid


class SheetShape(MeshShape):
    """A `Shape` around a mesh with a boundary: the distance to the mesh less a thickness T, with round rims."""

    def __init__(
        self,
        mesh: Mesh,
        name: str,
        source: dict[str, Any],
        *,
        thickness: float,
        **options: Any,
    ) -> None:
        """thickness: T, as a share of the sheet's radius; the solid is 2 T thick. Other arguments: of `MeshShape`.

        Raises UserError if the mesh is closed, too.
        """
        if closed(mesh.faces):
            raise UserError(f"{name}: --thicken is for open sheets; this mesh is closed")
        super().__init__(mesh, name, source | {"thicken": thickness}, margin=thickness, **options)
        self.thickness = thickness / (1 + thickness)
        self.open, self.warnings = False, []  # the solid around the sheet is closed
        self._inputs = self.surface(INPUTS, np.random.default_rng(0)).points

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw `count` points of the solid's surface: project random points towards their nearest point of the sheet.

        Raises UserError if nearly all projections are rejected.
        """
        parts: list[SurfacePoints] = []
        missing = count
        for _ in range(ROUNDS):
            start = super().surface(max(missing, 64), rng).points
            away = rng.normal(size=start.shape)
            away /= np.linalg.norm(away, axis=1, keepdims=True)
            thrown = start + REACH * self.thickness * away
            _, facet, nearest = self._tree.squared_distance(self._facets.vertices, self._facets.faces, thrown)
            out = thrown - nearest
            length = np.linalg.norm(out, axis=1)
            normals = out / np.maximum(length, 1e-12)[:, None]
            points = nearest + self.thickness * normals
            good = (length > 1e-9) & (self._unsigned(points) > self.thickness * (1 - SHORT))
            good[np.flatnonzero(good)[missing:]] = False
            found = self._colors_of(np.asarray(facet, np.int64)[good], nearest[good]) if colors else None
            parts.append(SurfacePoints(points[good], normals[good], found))
            missing -= len(parts[-1].points)
            if not missing:
                return joined(parts)
        raise UserError(f"{self.name}: --thicken: hardly any surface is left around this sheet; try another thickness")

    def distance(self, points: Doubles) -> Doubles:
        """Compute the distance (N,) to the sheet less the thickness."""
        return self._unsigned(points) - self.thickness

    def _colors_of(self, facet: NDArray[np.int64], places: Doubles) -> Doubles | None:
        """Look up colors (N, 3) at places (N, 3) on facets (N,); None without colors."""
        if not self.colored:
            return None
        barycentric: Any = trimesh.triangles.points_to_barycentric
        weights = barycentric(self._facets.vertices[self._facets.faces[facet]], places)
        return self._colors_at(facet, np.clip(np.nan_to_num(weights), 0, 1)[:, :, None])

    def _check_volume(self) -> None:
        """Accept any sheet: it encloses no volume."""
