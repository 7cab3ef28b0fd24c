"""Where the shape of a training comes from: a file, arrays, a folder of meshes, or two shapes to morph."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.endings import MESH_NAMES, MESHES
from ..model.errors import UserError
from ..model.files import is_folder, path_of, show
from ..model.gallery import SUFFIX, model_path
from ..model.model import Model
from ..model.model_file import load
from ..model.orientation import DEFAULT_UP, FILES_UP
from ..readers.clouds import mesh_of_arrays
from .networks.callback import TrainingProgress
from .options import CheckOptions, MorphOptions, TrainingOptions, TrainOptions
from .shapes.arrays import Arrays
from .shapes.demo import DemoShape
from .shapes.load import load_shape
from .shapes.mesh import MeshShape
from .shapes.motion import ColoredShape, Moment, MovingShape, common_place, placed
from .shapes.shape import Shape

Loaded = tuple[Shape, list[str]]
"""A shape, and warnings for the user."""
ModelSurface = tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.float32] | None]
"""Vertices (V, 3) in model space, faces (F, 3), and colors (V, 3), sRGB in [0, 1], or None."""
STAGE = "surfaces between"
"""Stage of the progress while the surfaces between two moments are computed."""


@dataclass(frozen=True)
class Source:
    """Where the shape of a training comes from."""

    load: Callable[[TrainingProgress, str], Loaded]
    """Loads the shape. The second argument is the axis that points up: the user's, or `up`."""
    up: str = DEFAULT_UP
    """Axis that points up by the format of the file."""
    stem: str = ""
    """Name of the model file, without its ending."""
    files: tuple[Path, ...] = ()
    """Files that are read, which no output may overwrite."""


def shape_source(shape: str | Path | Arrays, options: TrainOptions | CheckOptions) -> Source:
    """Return the source of one shape: a path, the word "demo", or arrays."""
    image = options.image

    def load_one(_: TrainingProgress, up: str) -> Loaded:
        return load_shape(
            shape,
            image,
            columns=options.columns,
            follow=options.follow,
            crease=options.crease_angle,
            noise=options.noise,
            up=up,
            thicken=options.thicken,
        )

    if not isinstance(shape, (str, Path)):
        return Source(load_one)
    path = path_of(shape, "shape")
    files = (path, *([] if image is None else [image]))
    return Source(load_one, FILES_UP.get(path.suffix.lower(), DEFAULT_UP), path.stem, files)


def frames_source(folder: str | Path | Arrays, options: TrainingOptions) -> Source:
    """Return the source of a motion whose moments are the meshes of a folder, by name, in one space.

    Raises UserError where the folder has fewer than two meshes.
    """
    if not isinstance(folder, (str, Path)):
        raise UserError("time: needs the path of a folder of meshes")
    folder = Path(folder)
    if not is_folder(folder):
        raise UserError(f"{show(folder)}: not a folder; --time needs a folder of meshes")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in MESHES and path.is_file())
    if len(paths) < 2:
        raise UserError(f"{show(folder)}: {len(paths)} meshes ({MESH_NAMES}); a motion needs at least two moments")

    def load_moments(progress: TrainingProgress, _: str) -> Loaded:
        shapes, warnings = _shapes([str(path) for path in paths], None, options, progress)
        place = common_place(shapes)
        moments = [placed(shape, *place) for shape in shapes]
        return _moving(moments, folder.name, place, progress), warnings

    return Source(load_moments, stem=folder.stem, files=tuple(paths))


def morph_source(
    first: str | Path | Model,
    second: str | Path | Model,
    surface_of: Callable[[Model], ModelSurface],
    options: MorphOptions,
) -> Source:
    """Return the source of a motion from one shape to another.

    first, second: models, paths of meshes or models, names of the gallery, or "demo". surface_of: extracts the surface
    of a model. Raises UserError.
    """
    ends = [end if isinstance(end, Model) else _end_path(str(end)) for end in (first, second)]
    paths = [path_of(end, "shape") for end in ends if isinstance(end, str)]

    def load_ends(progress: TrainingProgress, _: str) -> Loaded:
        shapes, warnings = _shapes(ends, surface_of, options, progress)
        if options.in_place:
            place = common_place(shapes)
            moments = [placed(shape, *place) for shape in shapes]
        else:  # Each shape fits the unit sphere; the first one gives the model's place.
            place = shapes[0].center, shapes[0].scale
            moments = [Moment(shape, np.zeros(3), 1.0) for shape in shapes]
        title = " to ".join(Path(shape.name).stem for shape in shapes)
        return _moving(moments, title, place, progress), warnings

    return Source(load_ends, stem="-to-".join(path.stem for path in paths), files=tuple(paths))


def _end_path(name: str) -> str:
    """Return the path of a mesh or a model, or "demo". Raises UserError."""
    return name if name == "demo" or Path(name).suffix.lower() in MESHES else str(model_path(name))


def _shapes(
    ends: Sequence[str | Model],
    surface_of: Callable[[Model], ModelSurface] | None,
    options: TrainingOptions,
    progress: TrainingProgress,
) -> tuple[list[ColoredShape], list[str]]:
    """Load shapes, say what was read of them, and return them with warnings. Raises UserError for point clouds.

    surface_of: extracts the surface of a model; None: there are only meshes. The axis that points up is the user's, or
    that of each file's format.
    """
    shapes: list[ColoredShape] = []
    warnings: list[str] = []
    for end in ends:
        if surface_of is not None and (isinstance(end, Model) or Path(end).suffix.lower() == SUFFIX):
            shapes.append(_of_model(end, surface_of))
            continue
        name = str(end)
        up = options.up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP)
        shape, more = load_shape(name, follow=options.follow, crease=options.crease_angle, up=up)
        if not isinstance(shape, MeshShape | DemoShape):
            raise UserError(f"{show(name)}: a point cloud cannot move; train a model of it first, and morph that")
        shapes.append(shape)
        warnings += more
        if shape.taken is not None and not options.quiet:
            progress.say(shape.taken.line())
    return shapes, warnings


def _of_model(end: str | Model, surface_of: Callable[[Model], ModelSurface]) -> MeshShape:
    """Return the surface of a model as a shape. end: the model, or the path of its file."""
    if isinstance(end, Model):
        model, source = end, {"file": end.name, "sha256": end.sha256()}
    else:
        model = load(Path(end))
        source = {"file": Path(end).name, "sha256": hashlib.sha256(Path(end).read_bytes()).hexdigest()}
    vertices, faces, colors = surface_of(model)
    painted = None if colors is None else colors.astype(np.float64)
    shape = MeshShape(mesh_of_arrays(vertices.astype(np.float64), faces, None, painted), model.name, source)
    x, y, z = (float(c) for c in np.array(model.center) + model.scale * np.array(shape.center))
    shape.center, shape.scale = (x, y, z), model.scale * shape.scale
    return shape


def _moving(
    moments: Sequence[Moment],
    name: str,
    place: tuple[tuple[float, float, float], float],
    progress: TrainingProgress,
) -> MovingShape:
    """Return the shape of all moments, with the surfaces between them."""
    center, scale = place
    source: dict[str, Any] = {
        "moments": [
            moment.shape.source
            | {
                # Position of the moment's shape in its own file, and in the model.
                "centre": list(moment.shape.center),
                "scale": moment.shape.scale,
                "offset": moment.offset.tolist(),
                "factor": moment.factor,
            }
            for moment in moments
        ]
    }
    progress.begin(STAGE)
    shape = MovingShape(moments, name, source, center, scale)
    progress.end()
    return shape
