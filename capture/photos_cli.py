"""The verb `photos`."""

import time
from dataclasses import dataclass
from pathlib import Path

from ..model.files import check_writable
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import MODEL
from ..model.options import argument, option
from ..model.verb import Verb, force_option, output_option
from ..trainer.openmp import prepare_openmp
from .options import PhotoOptions
from .photo_settings import photo_settings


@dataclass(frozen=True)
class PhotosCommand(PhotoOptions):
    """Command line of `photos`."""

    folder: Path = argument(
        "DIR",
        "photographs with cameras: image/, mask/ and cameras_sphere.npz (IDR, NeuS), or a transforms.json (nerfstudio, "
        "COLMAP's exports)",
    )
    output: Path | None = output_option("M.safetensors", "the model file (default: the folder's name, in this folder)")
    force: bool = force_option()
    resume: bool = option(False, "continue the interrupted reconstruction of NAME.part.safetensors")


def _photos(command: PhotosCommand) -> None:
    """Reconstruct a model from photographs, and write it. Raises UserError."""
    start = time.perf_counter()
    settings = photo_settings(command)
    output = command.output or Path((command.folder.resolve().name or "photographs") + SUFFIX)
    check_writable(output, kind=MODEL, force=command.force)
    prepare_openmp()
    from .photos_session import run

    begin_work()
    run(command.folder, output, settings, resume=command.resume, quiet=command.quiet, began=start)
    if by := ended_by():
        raise SystemExit(128 + by)


PHOTOS = Verb(
    "photos",
    "photographs with known cameras become a model file",
    PhotosCommand,
    "photos dtu_scan24 --camera-size 1600x1200",
    _photos,
)
