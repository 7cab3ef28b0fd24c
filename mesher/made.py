"""The surface of a model as a triangle mesh: what the verb `mesh` does, without its files and its lines of text."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import check_writable, write_whole
from ..model.kinds import MESH
from ..model.model import MODEL_SPACE, Model
from ..model.orientation import as_in_file
from .bar import Bar
from .eval_cli import DEFAULT_RESOLUTION
from .extract import check_resolution, extract_model, up_to
from .moment import chosen_time, place_at
from .surface import Array, Mesh, Whole
from .write import as_trimesh, check_suffix, to_bytes

if TYPE_CHECKING:
    import trimesh

SPACES = ("input", "model")
"""Coordinates of the shape trained on, and of the unit sphere."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A model's surface as triangles."""

    _mesh: Mesh
    """In model space."""
    _place: tuple[tuple[float, float, float], float, str]
    """`Model.place` of the space that the vertices are in."""
    components: int
    """Connected components."""
    spurious: int
    """Components outside the bands, which are left out unless culling was switched off."""

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(V, 3), in the space that was asked for."""
        centre, scale, up = self._place
        return as_in_file(self._mesh.vertices.astype(np.float64) * scale + centre, up)

    @property
    def faces(self) -> Whole:
        """(F, 3), numbers of vertices, counter-clockwise seen from outside."""
        return self._mesh.faces

    @property
    def normals(self) -> Array:
        """(V, 3), the field's own gradient at each vertex, of length 1."""
        normals = np.empty((0, 3)) if self._mesh.normals is None else self._mesh.normals
        return as_in_file(normals.astype(np.float64), self._place[2]).astype(np.float32)

    @property
    def colors(self) -> Array | None:
        """(V, 3), sRGB in [0, 1]; None where the model has no texture."""
        return self._mesh.colours

    def __repr__(self) -> str:
        """Say how many vertices and faces there are."""
        return f"<mplicits.TriangleMesh: {len(self._mesh.vertices):,} vertices, {len(self._mesh.faces):,} faces>"

    def to_trimesh(self) -> "trimesh.Trimesh":
        """Return the mesh as one of trimesh, with normals and colours."""
        return as_trimesh(self._mesh, *self._place)

    def save(self, path: str | Path) -> None:
        """Write a PLY, OBJ, STL or GLB file, by the ending of its name, whole or not at all. Raises UserError."""
        path = Path(path)
        check_suffix(path)
        check_writable(path, kind=MESH)
        write_whole(path, self.to_bytes(path.suffix.lower()))

    def to_bytes(self, suffix: str) -> bytes:
        """Return the content of a file whose name ends in `suffix`: ".ply", ".obj", ".stl" or ".glb"."""
        return to_bytes(self._mesh, suffix, *self._place)


def make_mesh(
    model: Model,
    resolution: int = DEFAULT_RESOLUTION,
    level: int | None = None,
    no_cull: bool = False,
    space: str = "input",
    quiet: bool = False,
    time: float | None = None,
) -> TriangleMesh:
    """Extract the surface of a model's level as triangles, by marching cubes.

    The arguments are the options of `mplicits mesh` (docs/meshing.md), with their names and defaults: resolution counts
    the cells along each side of the grid over [-1, 1]^3; level: None for the last; no_cull evaluates it at every vertex
    of the grid; space: "input" or "model"; quiet: show no progress bar; time: of a
    model that moves, from 0 to 1 (None: 0). Raises UserError.
    """
    moment = chosen_time(time, model)
    check_resolution(resolution)
    if space not in SPACES:
        raise UserError(f"space {space!r} is none of {', '.join(SPACES)}")
    bar = Bar(quiet)
    model = up_to(model, level)
    try:
        extracted = extract_model(model, resolution, bar, cull=not no_cull, time=moment)
    finally:
        bar.end()
    place = place_at(model, moment) if space == "input" else MODEL_SPACE
    return TriangleMesh(extracted.mesh, place, extracted.components, extracted.spurious)
