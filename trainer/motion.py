"""What moves, from files: two shapes of which one becomes the other, and a folder of moments."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.gallery import SUFFIX
from ..model.mesh_file import SUFFIXES
from ..model.model import Model, load
from ..model.orientation import DEFAULT_UP, FILES_UP
from .networks.fit import TrainingProgress
from .session import MovingLoader
from .shapes.demo import DemoShape
from .shapes.load import load_shape
from .shapes.mesh import MeshShape
from .shapes.motion import Coloured, Moment, MovingShape, common_place, placed
from .shapes.shape import Shape

ModelSurface = tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.float32] | None]
"""Vertices (V, 3) in model space, faces (F, 3), and colours (V, 3), sRGB in [0, 1], or None."""
STAGE = "surfaces between"
"""What the progress shows while they are computed."""


def frames(folder: Path) -> list[Path]:
    """List the meshes of a folder, by name. Raises UserError where it has none, or one."""
    if not folder.is_dir():
        raise UserError(f"{show(folder)}: not a folder; with --time, a folder of meshes is needed")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())
    if len(paths) < 2:
        raise UserError(f"{show(folder)}: {len(paths)} meshes (PLY OBJ STL GLB); a motion needs at least two moments")
    return paths


def frames_loader(options: Namespace, paths: Sequence[Path]) -> MovingLoader:
    """Make the loader of a folder of moments, which stand in one space."""

    def run(progress: TrainingProgress) -> tuple[Shape, list[str]]:
        shapes, warnings = _shapes([(str(path), None) for path in paths], options)
        place = common_place(shapes)
        moments = [placed(shape, *place) for shape in shapes]
        return _moving(moments, Path(options.shape).name, place, options, progress), warnings

    return run


def morph_loader(options: Namespace, surface_of: Callable[[Model], ModelSurface]) -> MovingLoader:
    """Make the loader of two shapes of which one becomes the other.

    surface_of: extracts the surface of a model. Each shape has its own model space, where it fits the unit sphere; with
    --in-place they stay where they are in the space that they share.
    """

    def run(progress: TrainingProgress) -> tuple[Shape, list[str]]:
        shapes, warnings = _shapes([(name, surface_of) for name in (options.first, options.second)], options)
        first, second = shapes
        own = first.centre, first.scale
        place = common_place(shapes) if options.in_place else own
        moments = [placed(shape, *place) if options.in_place else Moment(shape, np.zeros(3), 1.0) for shape in shapes]
        return _moving(moments, f"{_title(first)} to {_title(second)}", place, options, progress), warnings

    return run


def _title(shape: Shape) -> str:
    return Path(shape.name).stem


def _shapes(
    names: Sequence[tuple[str, Callable[[Model], ModelSurface] | None]], options: Namespace
) -> tuple[list[Coloured], list[str]]:
    """Read shapes, and the warnings about them. Raises UserError for what is no mesh, model or `demo`."""
    shapes: list[Coloured] = []
    warnings: list[str] = []
    for name, surface_of in names:
        if surface_of is not None and Path(name).suffix.lower() == SUFFIX:
            shapes.append(_of_model(Path(name), surface_of))
            continue
        up = options.up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP)
        shape, more = load_shape(name, crease=None if options.flat else options.crease, up=up)
        if not isinstance(shape, MeshShape | DemoShape):
            raise UserError(f"{show(name)}: a point cloud; what moves is made of meshes: train a model of it first")
        shapes.append(shape)
        warnings += more
    return shapes, warnings


def _of_model(path: Path, surface_of: Callable[[Model], ModelSurface]) -> MeshShape:
    """Make a shape of a model's surface."""
    import hashlib

    model = load(path)
    vertices, faces, colours = surface_of(model)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if colours is not None:
        mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.round(colours * 255).astype(np.uint8))
    source = {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    shape = MeshShape(mesh, model.name, source)
    x, y, z = (float(c) for c in np.array(model.centre) + model.scale * np.array(shape.centre))
    shape.centre, shape.scale = (x, y, z), model.scale * shape.scale
    return shape


def _moving(
    moments: Sequence[Moment],
    name: str,
    place: tuple[tuple[float, float, float], float],
    options: Namespace,
    progress: TrainingProgress,
) -> MovingShape:
    """Put the moments together, and compute the surfaces between them."""
    centre, scale = place
    source: dict[str, Any] = {
        "moments": [
            moment.shape.source
            | {
                # Where the moment's shape lies in its own file, and in the model.
                "centre": list(moment.shape.centre),
                "scale": moment.shape.scale,
                "offset": moment.offset.tolist(),
                "factor": moment.factor,
            }
            for moment in moments
        ]
    }
    progress.begin(STAGE)
    shape = MovingShape(moments, name, source, centre, scale)
    progress.end()
    return shape
