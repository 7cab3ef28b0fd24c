"""What moves, from files: two shapes of which one becomes the other, and a folder of moments."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import is_folder, show
from ..model.gallery import SUFFIX, model_path
from ..model.mesh_file import SUFFIXES
from ..model.model import Model
from ..model.model_file import load
from ..model.orientation import DEFAULT_UP, FILES_UP
from .networks.fit import TrainingProgress
from .session import Loader
from .shapes.demo import DemoShape
from .shapes.load import load_shape
from .shapes.mesh import MeshShape
from .shapes.motion import ColoredShape, Moment, MovingShape, common_place, placed
from .shapes.shape import Shape

ModelSurface = tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.float32] | None]
"""Vertices (V, 3) in model space, faces (F, 3), and colours (V, 3), sRGB in [0, 1], or None."""
STAGE = "surfaces between"
"""What the progress shows while they are computed."""


def frames(folder: Path) -> list[Path]:
    """List the meshes of a folder, by name. Raises UserError where it has none, or one."""
    if not is_folder(folder):
        raise UserError(f"{show(folder)}: not a folder; with --time, a folder of meshes is needed")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())
    if len(paths) < 2:
        raise UserError(f"{show(folder)}: {len(paths)} meshes (PLY OBJ STL GLB); a motion needs at least two moments")
    return paths


def end_called(name: str) -> str:
    """Return the path of a mesh or a model that a motion begins or ends with, or "demo". Raises UserError."""
    return name if name == "demo" or Path(name).suffix.lower() in SUFFIXES else str(model_path(name))


def frames_loader(folder: Path, paths: Sequence[Path], *, up: str | None, crease: float | None) -> Loader:
    """Make the loader of a folder of moments, which stand in one space.

    up: axis of the files that points up; None: as their format says. crease: as of `load_shape`.
    """

    def run(progress: TrainingProgress) -> tuple[Shape, list[str]]:
        shapes, warnings = _shapes([str(path) for path in paths], None, up, crease)
        place = common_place(shapes)
        moments = [placed(shape, *place) for shape in shapes]
        return _moving(moments, folder.name, place, progress), warnings

    return run


def morph_loader(
    ends: Sequence[str | Model],
    surface_of: Callable[[Model], ModelSurface],
    *,
    in_place: bool,
    up: str | None,
    crease: float | None,
) -> Loader:
    """Make the loader of two shapes of which one becomes the other.

    ends: models, or what `end_called` gives. surface_of: extracts the surface of a model. in_place: they stay where
    they are in the space that they share; otherwise each has its own model space, where it fits the unit sphere.
    up, crease: as of `frames_loader`.
    """

    def run(progress: TrainingProgress) -> tuple[Shape, list[str]]:
        shapes, warnings = _shapes(ends, surface_of, up, crease)
        first, second = shapes
        own = first.center, first.scale
        place = common_place(shapes) if in_place else own
        moments = [placed(shape, *place) if in_place else Moment(shape, np.zeros(3), 1.0) for shape in shapes]
        return _moving(moments, f"{_title(first)} to {_title(second)}", place, progress), warnings

    return run


def _title(shape: Shape) -> str:
    return Path(shape.name).stem


def _shapes(
    ends: Sequence[str | Model],
    surface_of: Callable[[Model], ModelSurface] | None,
    up: str | None,
    crease: float | None,
) -> tuple[list[ColoredShape], list[str]]:
    """Read shapes, and the warnings about them. Raises UserError for what is no mesh, model or `demo`."""
    shapes: list[ColoredShape] = []
    warnings: list[str] = []
    for end in ends:
        if surface_of is not None and (isinstance(end, Model) or Path(end).suffix.lower() == SUFFIX):
            shapes.append(_of_model(end, surface_of))
            continue
        name = str(end)
        upwards = up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP)
        shape, more = load_shape(name, crease=crease, up=upwards)
        if not isinstance(shape, MeshShape | DemoShape):
            raise UserError(f"{show(name)}: a point cloud; what moves is made of meshes: train a model of it first")
        shapes.append(shape)
        warnings += more
    return shapes, warnings


def _of_model(end: str | Model, surface_of: Callable[[Model], ModelSurface]) -> MeshShape:
    """Make a shape of a model's surface. end: the model, or the path of its file."""
    if isinstance(end, Model):
        model, source = end, {"file": end.name, "sha256": end.sha256()}
    else:
        model = load(Path(end))
        source = {"file": Path(end).name, "sha256": hashlib.sha256(Path(end).read_bytes()).hexdigest()}
    vertices, faces, colours = surface_of(model)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if colours is not None:
        mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.round(colours * 255).astype(np.uint8))
    shape = MeshShape(mesh, model.name, source)
    x, y, z = (float(c) for c in np.array(model.centre) + model.scale * np.array(shape.center))
    shape.center, shape.scale = (x, y, z), model.scale * shape.scale
    return shape


def _moving(
    moments: Sequence[Moment],
    name: str,
    place: tuple[tuple[float, float, float], float],
    progress: TrainingProgress,
) -> MovingShape:
    """Put the moments together, and compute the surfaces between them."""
    centre, scale = place
    source: dict[str, Any] = {
        "moments": [
            moment.shape.source
            | {
                # Where the moment's shape lies in its own file, and in the model.
                "centre": list(moment.shape.center),
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
