"""The surface of a model as a triangle mesh: the work of `mesh`, without its files and messages."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..model.files import check_writable, path_of, write_whole
from ..model.kinds import MESH
from ..model.model import MODEL_SPACE, Model
from ..model.orientation import as_in_file
from .at_time import chosen_time, place_at
from .extract import extract_model, up_to
from .grid import Grid
from .options import MeshOptions
from .progress import Bar
from .specks import without_specks
from .surface import Array, Mesh, Whole
from .write import as_trimesh, check_suffix, rounding_warning, to_bytes

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A model's surface as triangles."""

    _mesh: Mesh
    """The mesh in model space."""
    _place: tuple[tuple[float, float, float], float, str]
    """`Model.place` of the space of the vertices."""
    components: int
    """Connected components."""
    spurious: int
    """Components outside the bands; they are removed unless culling is off."""
    specks: int
    """Removed specks (specks.py)."""

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(V, 3), in input space or model space."""
        center, scale, up = self._place
        return as_in_file(self._mesh.vertices.astype(np.float64) * scale + center, up)

    @property
    def faces(self) -> Whole:
        """(F, 3), indices of vertices, counter-clockwise as seen from outside."""
        return self._mesh.faces

    @property
    def normals(self) -> Array:
        """(V, 3), unit gradient of the field at each vertex."""
        normals = np.empty((0, 3)) if self._mesh.normals is None else self._mesh.normals
        return as_in_file(normals.astype(np.float64), self._place[2]).astype(np.float32)

    @property
    def colors(self) -> Array | None:
        """(V, 3), sRGB in [0, 1]; None without a texture."""
        return self._mesh.colors

    def __repr__(self) -> str:
        """Count vertices and faces."""
        return f"<mplicits.TriangleMesh: {len(self._mesh.vertices):,} vertices, {len(self._mesh.faces):,} faces>"

    def to_trimesh(self) -> "trimesh.Trimesh":
        """Convert the mesh, with normals and colors, to trimesh."""
        return as_trimesh(self._mesh, *self._place)

    def save(self, path: str | Path) -> None:
        """Write a PLY, OBJ, STL or GLB file, by the suffix of its name. Raises UserError."""
        path = path_of(path, "path")
        check_suffix(path)
        check_writable(path, kind=MESH)
        if warning := self.warning(path.suffix.lower()):
            warnings.warn(warning, stacklevel=2)
        write_whole(path, self.to_bytes(path.suffix.lower()))

    def warning(self, suffix: str) -> str:
        """Return what a format, by its suffix, would lose of large coordinates; "" for nothing."""
        return rounding_warning(self.vertices, self._place[1], suffix)

    def to_bytes(self, suffix: str) -> bytes:
        """Return the content of a file with the suffix ".ply", ".obj", ".stl" or ".glb"."""
        return to_bytes(self._mesh, suffix, *self._place)


def make_mesh(model: Model, options: MeshOptions) -> TriangleMesh:
    """Extract the surface of a model's level as triangles, by marching cubes. Raises UserError."""
    time = chosen_time(options.time, model)
    bar = Bar(options.quiet)
    model = up_to(model, options.level)
    try:
        extracted = extract_model(model, options.resolution, bar, cull=not options.no_cull, time=time)
    finally:
        bar.end()
    mesh, specks = extracted.mesh, 0
    if not options.keep_specks:
        mesh, specks = without_specks(mesh, Grid(options.resolution).diagonal)
    place = place_at(model, time) if options.space == "input" else MODEL_SPACE
    return TriangleMesh(mesh, place, extracted.components - specks, extracted.spurious, specks)
