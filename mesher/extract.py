"""Marching cubes (Lorensen and Cline 1987), by libigl, on the cells that the surface crosses."""

import math
from dataclasses import dataclass, replace

import igl
import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.model import Model
from .cull import culled, dense
from .grid import Grid
from .model_field import Field, ModelField
from .parallel import Progress, Silent, over
from .surface import Mesh


def up_to(model: Model, level: int | None) -> Model:
    """Return a model without the levels after `level`; None keeps all. Raises UserError without such a level."""
    if level is None:
        return model
    if not 1 <= level <= len(model.levels):
        raise UserError(f"--level {level}: the model has levels 1 to {len(model.levels)}")
    return replace(model, levels=model.levels[:level])


@dataclass(frozen=True)
class Extracted:
    """The surface of a model."""

    mesh: Mesh
    """Mesh with normals, and with colors if the model has a texture."""
    components: int
    """Connected components of the mesh."""
    spurious: int
    """Components outside the bands, where the last level is undefined (Fig. 8).

    Culling removes them from `mesh` and `components`.
    """


def extract(field: Field, resolution: int, progress: Progress | None = None, cull: bool = True) -> Mesh:
    """Extract the zero level set of a field: a closed mesh, oriented outwards, without duplicate vertices.

    resolution: cells along each side of the grid. cull: skip blocks of cells that the field's clearance rules out;
    otherwise evaluate every vertex of the grid. The mesh may be empty.
    """
    grid, progress = Grid(resolution), progress or Silent()
    cells = (culled if cull else dense)(field, grid, progress)
    if not len(cells.cells):
        return Mesh(np.empty((0, 3), np.float32), np.empty((0, 3), np.int64))
    progress.begin("marching cubes", 1)
    positions = grid.positions(cells.keys)
    vertices, faces, _ = igl.marching_cubes(cells.values.astype(np.float64), positions, cells.corners, 0.0)
    progress.advance(1)
    return Mesh(vertices.astype(np.float32), faces[:, ::-1])


def extract_model(
    model: Model, resolution: int, progress: Progress | None = None, cull: bool = True, time: float = 0.0
) -> Extracted:
    """Extract the surface of a model's last level, in model space.

    resolution, cull: as of `extract`. time: time of a moving model. Raises UserError without a surface.
    """
    progress = progress or Silent()
    field = ModelField(model, Grid(resolution).diagonal if cull else math.inf, time)
    mesh = extract(field, resolution, progress, cull)

    def work(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        return field.on_surface(points)

    progress.begin("normals", len(mesh.vertices))
    normals, inside = over(mesh.vertices, work, progress, field.chunk)
    mesh = replace(mesh, normals=normals)
    count, component = mesh.components()
    nested = np.zeros(count, np.bool_)
    nested[component[inside]] = True
    if not nested.any():
        raise UserError("the model has no surface in [-1, 1]^3; train it again")
    if cull:
        mesh = mesh.only(nested[component])
    if model.colored:
        progress.begin("colors", len(mesh.vertices))
        (colors,) = over(mesh.vertices, lambda points: (field.color(points),), progress, field.chunk)
        mesh = replace(mesh, colors=colors)
    spurious = int(count - nested.sum())
    return Extracted(mesh, count - spurious if cull else count, spurious)
