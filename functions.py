"""What `import mplicits` offers beside `Field`: functions for the verbs that make a model, or judge one."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .capture.photo_settings import HELD_OUT, RADIANCE, RAYS
from .field import Field
from .model.errors import UserError
from .model.gallery import model_path
from .model.model import load as load_model
from .trainer.cli import before_torch
from .trainer.options import CREASE
from .trainer.settings import DEFAULT_PRESET

if TYPE_CHECKING:
    from .mesher.evaluation import Evaluation
    from .trainer.learn import Callback
    from .trainer.options import Numbers
    from .trainer.shapes.given import Given


def load(source: str | Path | bytes) -> Field:
    """Load a model.

    source: a path, a name of the gallery ("spot"; a file of that name comes first), or the bytes of a model file.
    Raises UserError where there is no such model, or where it is damaged.
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


def train(
    shape: "str | Path | Given",
    levels: str | Sequence[str] | None = None,
    preset: str = DEFAULT_PRESET,
    packed: bool = False,
    omega: "Numbers | None" = None,
    seconds: float | None = None,
    steps: "Numbers | None" = None,
    texture: str = "auto",
    texture_network: str | None = None,
    crease: float = CREASE,
    flat: bool = False,
    thicken: float | None = None,
    noise: float | None = None,
    up: str | None = None,
    front: "Numbers | None" = None,
    credit: str | None = None,
    seed: int = 0,
    device: str = "auto",
    weights: str | Mapping[str, float] | None = None,
    quiet: bool = False,
    resume: Field | None = None,
    callback: "Callback | None" = None,
    follow: Callable[[Field], object] | None = None,
) -> Field:
    """Train a model of a shape, and return it; `Field.save` writes it to a file.

    shape: the path of a mesh or of an oriented point cloud, the word "demo", a `trimesh.Trimesh`, arrays (vertices,
    faces), or arrays (points, normals) or (points, normals, colours). levels: "64x1,64x2", or ["64x1", "64x2"].
    seconds: of wall time for all of it, in place of steps. callback: is told the stage, the share of it that is done
    and the loss, over and over; it may raise KeyboardInterrupt, which ends the training with what is trained so far.
    resume: a model to go on with. follow: receives a `Field` after every level. The other options are those of
    `mplicits train`, with their names and defaults (docs/training.md). Raises UserError.
    """
    before_torch()
    from .trainer.learn import learn

    model = learn(
        shape,
        levels=levels,
        preset=preset,
        packed=packed,
        omega=omega,
        seconds=seconds,
        steps=steps,
        texture=texture,
        texture_network=texture_network,
        crease=crease,
        flat=flat,
        thicken=thicken,
        noise=noise,
        up=up,
        front=front,
        credit=credit,
        seed=seed,
        device=device,
        weights=weights,
        quiet=quiet,
        resume=None if resume is None else resume.model,
        callback=callback,
        follow=None if follow is None else lambda model: follow(Field(model)),
    )
    return Field(model)


def photos(
    folder: str | Path,
    levels: str | Sequence[str] | None = None,
    omega: "Numbers | None" = None,
    radiance: int = RADIANCE,
    rays: int = RAYS,
    seconds: float | None = None,
    steps: int | None = None,
    held_out: int = HELD_OUT,
    background: str = "black",
    scale: float | None = None,
    camera_size: str | Sequence[int] | None = None,
    sphere: "Numbers | None" = None,
    up: str | None = None,
    credit: str | None = None,
    seed: int = 0,
    device: str = "auto",
    quiet: bool = False,
) -> Field:
    """Make a model of photographs whose cameras are known, and return it; `Field.save` writes it to a file.

    folder: image/, mask/ and cameras_sphere.npz (IDR, NeuS), or a transforms.json beside pictures (nerfstudio). The
    other options are those of `mplicits photos`, with their names and defaults (docs/capture.md). Raises UserError.
    """
    before_torch()
    from .capture.photos_session import photos as reconstruct

    model = reconstruct(
        Path(folder),
        levels=levels,
        omega=omega,
        radiance=radiance,
        rays=rays,
        seconds=seconds,
        steps=steps,
        held_out=held_out,
        background=background,
        scale=scale,
        camera_size=camera_size,
        sphere=sphere,
        up=up,
        credit=credit,
        seed=seed,
        device=device,
        quiet=quiet,
    )
    return Field(model)


def evaluate(
    model: Field | str | Path,
    shape: str | Path,
    resolution: int | None = None,
    level: int | None = None,
    samples: int = 500_000,
    seed: int = 0,
    quiet: bool = False,
    time: float | None = None,
) -> "Evaluation":
    """Compare a model, or somebody else's mesh, with the ground truth (Section 4).

    model: a model, its path or its name in the gallery, or the path of a mesh (PLY, OBJ, STL, GLB). shape: the path of
    the mesh that is the truth. The options are those of `mplicits eval`, with their names and defaults. Raises
    UserError.
    """
    from .mesher.evaluation import evaluate as compare
    from .model.mesh_file import SUFFIXES

    if isinstance(model, Field):
        return model.evaluate(shape, resolution, level, samples, seed, quiet, time)
    path = model_path(str(model))
    other = path if path.suffix.lower() in SUFFIXES else load_model(path)
    return compare(other, Path(shape), resolution, level, samples, seed, quiet, time)


def compose(scene: str | Path) -> Field:
    """Place and join models as one, as the file of a scene says (docs/scenes.md).

    scene: its path (TOML). Raises UserError, one line that names the file, the line and the key.
    """
    from .scenes.composed import compose as composed

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
    before_torch()
    from .trainer.imported import import_checkpoints as imported

    files = [Path(path) for path in checkpoints]
    return Field(imported(files, omega, None if shape is None else str(shape), front, credit))
