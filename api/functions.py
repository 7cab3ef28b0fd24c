"""Functions of `import mplicits`: a verb of the command line each, and `load`."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from ..capture.options import PhotoOptions, UnprojectOptions
from ..mesher.options import EvalOptions
from ..model.errors import UserError
from ..model.gallery import model_path
from ..model.model_file import load as load_model
from ..model.options import takes
from ..trainer.openmp import prepare_openmp
from ..trainer.options import TrainingOptions, settings_from, shows_options
from .field import Field
from .notebook import Preview
from .pictures import Pictures

if TYPE_CHECKING:
    from ..capture.unprojection import Unprojected
    from ..mesher.evaluation import Evaluation
    from ..model.model import Model
    from ..trainer.learn import Callback
    from ..trainer.options import Numbers
    from ..trainer.shapes.arrays import Arrays


def load(source: str | Path | bytes) -> Field:
    """Load a model.

    source: a path, a name of the gallery such as "spot" (a file of that name takes precedence), or the bytes of a model
    file. Raises UserError where the model does not exist or is damaged.
    """
    if not isinstance(source, bytes):
        return Field(load_model(model_path(str(source))))
    with tempfile.TemporaryDirectory(prefix="mplicits-") as folder:
        path = Path(folder, "bytes")
        path.write_bytes(source)
        try:
            return Field(load_model(path))
        except UserError as error:
            raise UserError(str(error).replace(str(path), "these bytes", 1)) from None


@shows_options(settings_from)
def train(
    shape: "str | Path | Arrays",
    levels: str | Sequence[str] | None = None,
    *,
    time: bool = False,
    flat: bool = False,
    quiet: bool = False,
    resume: Field | None = None,
    callback: "Callback | None" = None,
    follow: Callable[[Field], object] | None = None,
    log: str | Path | None = None,
    preview: bool | str | Path = False,
    **options: Unpack[TrainingOptions],
) -> Field:
    """Train a model of a shape, and return it; `Field.save` writes it to a file.

    shape: the path of a mesh or of an oriented point cloud, the word "demo", a `trimesh.Trimesh`, arrays (vertices,
    faces), or arrays (points, normals) or (points, normals, colours); with `time`, a folder of meshes that are moments
    of one motion. levels: "64x1,64x2", or ["64x1", "64x2"]. seconds: of wall time for all of it, in place of steps.
    callback: is told the stage, the share of it that is done and the loss, over and over; it may raise
    KeyboardInterrupt, which ends the training with what is trained so far. resume: a model to go on with. follow:
    receives a `Field` after every level. log: a file that gets a line of JSON for every report. preview: show a picture
    of each level in a notebook; a path: draw them into that folder. The other options are those of `mplicits train`,
    with their names and defaults (docs/training.md). Raises UserError.
    """
    prepare_openmp()
    from ..trainer.learn import learn
    from .hooks import loose_pieces

    before, follower = None if resume is None else resume.model, _Follower(follow, preview)
    return follower.ended(
        learn(
            shape,
            levels,
            time=time,
            flat=flat,
            quiet=quiet,
            resume=before,
            callback=callback,
            follow=follower,
            log=log,
            find=loose_pieces,
            **options,
        )
    )


@shows_options(settings_from)
def morph(
    first: Field | str | Path,
    second: Field | str | Path,
    levels: str | Sequence[str] | None = None,
    *,
    in_place: bool = False,
    flat: bool = False,
    quiet: bool = False,
    resume: Field | None = None,
    callback: "Callback | None" = None,
    follow: Callable[[Field], object] | None = None,
    log: str | Path | None = None,
    preview: bool | str | Path = False,
    **options: Unpack[TrainingOptions],
) -> Field:
    """Train a model that moves: it is `first` at time 0, `second` at time 1, and surfaces between them meanwhile.

    first, second: models, names of the gallery, paths of meshes or models, or the word "demo". in_place: leave both
    where they are, in the one space that they share; otherwise each fits the unit sphere. The others are those of
    `train`. Raises UserError.
    """
    prepare_openmp()
    from ..trainer.learn import morph as learn_morph
    from .hooks import surface_of

    before, follower = None if resume is None else resume.model, _Follower(follow, preview)
    return follower.ended(
        learn_morph(
            first.model if isinstance(first, Field) else first,
            second.model if isinstance(second, Field) else second,
            lambda model: surface_of(model, quiet),
            levels,
            in_place=in_place,
            flat=flat,
            quiet=quiet,
            resume=before,
            callback=callback,
            follow=follower,
            log=log,
            **options,
        )
    )


class _Follower:
    """Receives the levels of a training: hands them to the caller, and shows them."""

    def __init__(self, follow: Callable[[Field], object] | None, preview: bool | str | Path) -> None:
        self._follow = follow
        self._preview = Preview() if preview is True else None
        self._pictures = Pictures(Path(preview)) if preview and preview is not True else None

    def __call__(self, model: "Model") -> None:
        field = self.ended(model)
        if self._follow is not None:
            self._follow(field)

    def ended(self, model: "Model") -> Field:
        """Show the model, and return it as programs use it."""
        field = Field(model)
        if self._preview is not None:
            self._preview.show(field)
        if self._pictures is not None:
            self._pictures.draw(model)
        return field


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

    return Field(reconstruct(Path(folder), options))


@takes(EvalOptions)
def evaluate(model: Field | str | Path, shape: str | Path, options: EvalOptions) -> "Evaluation":
    """Compare a model, or another program's mesh, with the ground truth (Section 4).

    model: a model, its path or its name in the gallery, or the path of a mesh (PLY, OBJ, STL, GLB). shape: path of the
    mesh that is the ground truth. Raises UserError.
    """
    from ..mesher.evaluation import evaluate as compare
    from ..model.mesh_file import SUFFIXES

    if isinstance(model, Field):
        return compare(model.model, Path(shape), options)
    path = model_path(str(model))
    return compare(path if path.suffix.lower() in SUFFIXES else load_model(path), Path(shape), options)


def report(model: Field | str | Path, shape: str | Path | None = None, log: str | Path | None = None) -> str:
    """Return a page about a model and its training: HTML in one file.

    model: a model, its path or its name in the gallery. shape: path of the ground truth, a mesh, for the error of the
    surface. log: path of the training's log, for the curves. Raises UserError.
    """
    from ..reporting.page import report as page

    return page(model.model if isinstance(model, Field) else load_model(model_path(str(model))), shape, log)


def compose(scene: str | Path) -> Field:
    """Place and join models as one model. scene: path of a TOML file (docs/scenes.md).

    Raises UserError, which names the file, the line and the key.
    """
    from ..scenes.compose import compose as composed

    return Field(composed(scene))


def import_checkpoints(
    checkpoints: Sequence[str | Path],
    omega: "Numbers | None" = None,
    shape: str | Path | None = None,
    front: "Numbers | None" = None,
    credit: str | None = None,
) -> Field:
    """Make a model of checkpoints of the authors' own release, coarse to fine.

    The options are those of `mplicits import`, with their names and defaults (docs/training.md). Raises UserError.
    """
    prepare_openmp()
    from ..trainer.imported import import_checkpoints as imported

    files = [Path(path) for path in checkpoints]
    return Field(imported(files, omega, None if shape is None else str(shape), front, credit))
