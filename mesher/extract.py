"""Marching cubes (Lorensen and Cline 1987) on the cells that the surface passes; the table is libigl's."""

import math
from dataclasses import dataclass, replace

import igl
import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.model import Model
from .cull import culled, dense
from .field import Field, ModelField
from .grid import Grid
from .parallel import Progress, Silent, over
from .surface import Mesh

LEAST, MOST = 8, 4096
"""Resolutions."""


def check_resolution(resolution: int) -> None:
    """Raises UserError where a grid cannot have so many cells along a side."""
    if not LEAST <= resolution <= MOST:
        raise UserError(f"--resolution {resolution}: a whole number from {LEAST} to {MOST} is needed")


def up_to(model: Model, level: int | None) -> Model:
    """The model's first levels; None: all. Raises UserError where it has no such level."""
    if level is None:
        return model
    if not 1 <= level <= len(model.levels):
        raise UserError(f"--level {level}: the model has levels 1 to {len(model.levels)}")
    return replace(model, levels=model.levels[:level])


@dataclass(frozen=True)
class Extracted:
    """mesh: with normals, and colours where the model has a texture.

    components: of the mesh. spurious: components outside the bands, where the last level is not defined; culling
    removes them (Fig. 8), without it they are in the mesh.
    """

    mesh: Mesh
    components: int
    spurious: int


def extract(field: Field, resolution: int, progress: Progress | None = None, cull: bool = True) -> Mesh:
    """The zero level set of `field` on a grid of resolution^3 cells: closed, oriented outwards, each vertex once.

    cull: leave out the blocks that the field's clearance rules out; otherwise every vertex of the grid is evaluated.
    """
    grid, progress = Grid(resolution), progress or Silent()
    found = (culled if cull else dense)(field, grid, progress)
    if not len(found.cells):
        return Mesh(np.empty((0, 3), np.float32), np.empty((0, 3), np.int64))
    progress.begin("marching cubes", 1)
    positions = grid.positions(found.keys)
    vertices, faces, _ = igl.marching_cubes(found.values.astype(np.float64), positions, found.corners, 0.0)
    progress.advance(1)
    return Mesh(vertices.astype(np.float32), faces[:, ::-1])


def extract_model(model: Model, resolution: int, progress: Progress | None = None, cull: bool = True) -> Extracted:
    """The surface of a model's last level, model space. Raises UserError where there is none."""
    progress = progress or Silent()
    field = ModelField(model, Grid(resolution).diagonal if cull else math.inf)
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
        raise UserError("the model has no surface in [-1, 1]^3; train it anew")
    if cull:
        mesh = mesh.only(nested[component])
    if model.texture is not None:
        progress.begin("colours", len(mesh.vertices))
        (colours,) = over(mesh.vertices, lambda points: (field.colour(points),), progress, field.chunk)
        mesh = replace(mesh, colours=colours)
    spurious = int(count - nested.sum())
    return Extracted(mesh, count - spurious if cull else count, spurious)
