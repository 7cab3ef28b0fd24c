"""Functions of `import mplicits`: a verb of the command line each, and `load`."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..capture.options import PhotoOptions, UnprojectOptions
from ..mesher.options import EvalOptions
from ..model.errors import UserError
from ..model.files import path_of
from ..model.gallery import model_path
from ..model.model_file import load as load_model
from ..model.options import takes
from ..trainer.openmp import prepare_openmp
from ..trainer.options import CheckOptions, ImportOptions, MorphOptions, TrainOptions
from .field import Field
from .notebook import NotebookPreview
from .pictures import pictures
from .training import finished, source_of_morph, source_of_shape

if TYPE_CHECKING:
    from ..capture.unprojection import Unprojected
    from ..mesher.evaluation import Evaluation
    from ..model.model import Model
    from ..trainer.check import Checked
    from ..trainer.progress import ProgressCallback
    from ..trainer.shapes.arrays import Arrays
    from ..trainer.sources import Source


def load(source: str | Path | bytes) -> Field:
    """Load a model.

    source: a path, a name of the gallery such as "spot" (a file of that name takes precedence), or the bytes of a model
    file. Raises UserError where the model does not exist or is damaged.
    """
    if not isinstance(source, (bytes, bytearray, memoryview)):
        return Field(load_model(model_path(str(path_of(source, "source")))))
    with tempfile.TemporaryDirectory(prefix="mplicits-") as folder:
        path = Path(folder, "bytes")
        path.write_bytes(bytes(source))  # a memoryview may have gaps
        try:
            return Field(load_model(path))
        except UserError as error:
            raise UserError(str(error).replace(str(path), "these bytes", 1)) from None


@dataclass(frozen=True)
class _PythonArguments:
    """Arguments of `train` and `morph` that the command line does not have."""

    resume: Field | None = None
    callback: "ProgressCallback | None" = None
    after_level: Callable[[Field], object] | None = None
    preview: bool | str | Path = False


@dataclass(frozen=True)
class TrainArguments(_PythonArguments, TrainOptions):
    """Arguments of `train`."""


@dataclass(frozen=True)
class MorphArguments(_PythonArguments, MorphOptions):
    """Arguments of `morph`."""


@takes(TrainArguments)
def train(shape: "str | Path | Arrays", options: TrainArguments) -> Field:
    """Train a model of a shape, and return it; `Field.save` writes it to a file. See also docs/training.md.

    shape: the path of a mesh or of a point cloud, the word "demo", a mesh, point cloud or scene of trimesh, arrays
    (vertices, faces), points, or arrays (points, normals[, colors]); with `time`, a folder of meshes.

    resume: a model to continue. callback: receives the stage, the share of it that is done and the loss, repeatedly; it
    may raise KeyboardInterrupt: the training then ends and keeps its weights. after_level: receives a `Field`
    after every level. preview: True: show a picture of each level in a notebook; a path: draw them into that folder.

    Raises UserError.
    """
    prepare_openmp()
    return _field(source_of_shape(shape, options), options)


@takes(CheckOptions)
def check(shape: "str | Path | Arrays", options: CheckOptions) -> "Checked":
    """Read a shape as `train` would: what is taken in one line, the warnings, and a picture.

    shape: as of `train`. Raises UserError.
    """
    prepare_openmp()
    from ..trainer.check import check as checked

    return checked(shape, options)


@takes(MorphArguments)
def morph(first: Field | str | Path, second: Field | str | Path, options: MorphArguments) -> Field:
    """Train a model that moves: it is `first` at time 0, `second` at time 1, and surfaces between them meanwhile.

    first, second: models, names of the gallery, paths of meshes or models, or the word "demo". resume, callback,
    after_level, preview: as in `train`. Raises UserError.
    """
    prepare_openmp()
    ends = [end.model if isinstance(end, Field) else end for end in (first, second)]
    return _field(source_of_morph(ends[0], ends[1], options), options)


def _field(source: "Source", options: TrainArguments | MorphArguments) -> Field:
    """Train, show each level as `options` say, and return the model."""
    from ..trainer.session import Request

    previews: list[Callable[[Model], object]] = []
    if options.preview is True:
        notebook = NotebookPreview()
        previews.append(lambda model: notebook.show(Field(model)))
    elif options.preview:
        previews.append(pictures(path_of(options.preview, "--preview")))
    after = options.after_level
    request = Request(
        resume=False if options.resume is None else options.resume.model,
        callback=options.callback,
        previews=previews,
        after_level=None if after is None else lambda model: after(Field(model)),
    )
    return Field(finished(source, options, request).model)


@takes(UnprojectOptions)
def unproject(options: UnprojectOptions) -> "Unprojected":
    """Turn a depth map, or a photograph, into an oriented point cloud (Appendix G.1), which `train` takes.

    More in docs/capture.md. Raises UserError.
    """
    from ..capture.unprojection import unprojected

    return unprojected(options)


@takes(PhotoOptions)
def photos(folder: str | Path, options: PhotoOptions) -> Field:
    """Reconstruct a model from photographs with known cameras, and return it; `Field.save` writes it to a file.

    folder: image/, mask/ and cameras_sphere.npz (IDR, NeuS), or a transforms.json beside pictures (nerfstudio). More in
    docs/capture.md. Raises UserError.
    """
    prepare_openmp()
    from ..capture.session import photos as reconstruct

    return Field(reconstruct(path_of(folder, "folder"), options))


@takes(EvalOptions)
def evaluate(model: Field | str | Path, shape: str | Path, options: EvalOptions) -> "Evaluation":
    """Compare a model, or another program's mesh, with the ground truth (Section 4).

    model: a model, its path or its name in the gallery, or the path of a mesh (PLY, OBJ, STL, GLB). shape: path of the
    mesh that is the ground truth. Raises UserError.
    """
    from ..mesher.evaluation import evaluate as compare
    from ..model.endings import MESHES

    truth = path_of(shape, "shape")
    if isinstance(model, Field):
        return compare(model.model, truth, options)
    path = model_path(str(model))
    return compare(path if path.suffix.lower() in MESHES else load_model(path), truth, options)


def report(
    model: Field | str | Path,
    shape: str | Path | None = None,
    log: str | Path | None = None,
    *,
    follow: bool = False,
) -> str:
    """Return a page about a model and its training: HTML in one file.

    model: a model, its path or its name in the gallery. shape: path of the ground truth, a mesh, for the error of the
    surface. log: path of the training's log, for the curves. follow: read also what the mesh's file names
    outside of its folder. Raises UserError.
    """
    from ..reporting.page import report as page

    named = {"shape": shape, "log": log}
    paths = {name: path_of(value, name) for name, value in named.items() if value is not None}
    return page(model.model if isinstance(model, Field) else load_model(model_path(str(model))), **paths, follow=follow)


def compose(scene: str | Path, *, follow: bool = False) -> Field:
    """Place and join models as one model. scene: path of a TOML file (docs/scenes.md).

    follow: read also models outside of its folder.

    Raises UserError, which names the file, the line and the key.
    """
    from ..scenes.compose import compose as composed

    return Field(composed(path_of(scene, "scene"), follow))


@takes(ImportOptions)
def import_checkpoints(checkpoints: Sequence[str | Path], options: ImportOptions) -> Field:
    """Return a model of checkpoints of the authors' own release, coarse to fine (docs/training.md).

    Raises UserError.
    """
    prepare_openmp()
    from ..trainer.import_authors import import_checkpoints as imported

    listed = checkpoints if isinstance(checkpoints, Sequence) and not isinstance(checkpoints, str) else [checkpoints]
    return Field(imported([path_of(path, "checkpoints") for path in listed], options))
