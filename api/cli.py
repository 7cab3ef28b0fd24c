"""The verbs `train` and `morph` of the command line."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.errors import UserError
from ..model.files import check_writable, is_folder, show
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import LOG, MODEL
from ..model.verb import Verb
from ..trainer.commands import MorphCommand, TrainCommand
from ..trainer.openmp import prepare_openmp

if TYPE_CHECKING:
    from ..trainer.sources import Source


def _train(command: TrainCommand) -> None:
    """Train a model of a shape, or of every shape of a folder. Raises UserError."""
    prepare_openmp()
    if is_folder(Path(command.shape)) and not command.time:
        from ..trainer.folder import run_folder

        run_folder(command)
        return
    if flags := command.changed("jobs"):
        raise UserError(f"{flags}: for a folder of shapes")
    from .training import source_of_shape

    _run(command, source_of_shape(command.shape, command))


def _morph(command: MorphCommand) -> None:
    """Train the motion from A to B. Raises UserError."""
    prepare_openmp()
    from .training import source_of_morph

    _run(command, source_of_morph(command.first, command.second, command))


def _run(command: TrainCommand | MorphCommand, source: "Source") -> None:
    """Train, write the model, and print its summary. Raises UserError."""
    output = command.output or Path(source.stem + SUFFIX)
    check_writable(output, source.files, kind=MODEL, force=command.force)
    if command.log is not None:
        log = Path(command.log)
        if log.resolve() == output.resolve():
            raise UserError(f"--log {show(log)}: that is the model file; name another")
        check_writable(log, source.files, kind=LOG)
    from ..mesher.surface_line import describe_surface
    from ..trainer.session import Request
    from ..trainer.summary import figures, summary
    from .pictures import pictures
    from .training import finished

    previews = () if command.preview is None else (pictures(command.preview),)
    begin_work(termination=not command.live)
    request = Request(output=output, resume=command.resume, live=command.live, previews=previews)
    done = finished(source, command, request)
    if command.json:
        print(json.dumps(figures(done.exact, output) | {"input": done.read}))
    else:
        print(summary(done.exact, output))
    if by := ended_by():
        raise SystemExit(128 + by)
    if not (command.live or command.json or done.exact.provenance["interrupted"]):
        print(describe_surface(done.model, command.quiet))


VERBS = (
    Verb(
        "train",
        "a mesh or an oriented point cloud becomes a model file",
        TrainCommand,
        "train bunny.ply -o bunny.safetensors --seconds 60",
        _train,
    ),
    Verb(
        "morph",
        "one shape becomes another while time goes by",
        MorphCommand,
        "morph spot bob -o spot-to-bob.safetensors",
        _morph,
    ),
)
