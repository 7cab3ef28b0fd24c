"""`mplicits train DIR -o OUT/`: every shape of a folder becomes a model, with a table and a page of all of them."""

import hashlib
import os
import sys
from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from ..model import kinds
from ..model.errors import UserError
from ..model.files import check_writable, show
from ..model.gallery import PART, SUFFIX
from ..model.interrupts import begin_work, ended_by, let_children_hear_ctrl_c
from ..model.model_file import load
from ..model.verb import command_line
from ..readers.read import READERS, known_formats
from .commands import TrainCommand
from .folders.job import Job, Outcome, Progress, Status, outcomes
from .folders.results import PAGE, TABLE, Row, row_of, write_results
from .options import TrainOptions
from .settings import Settings

SHAPES = {*READERS} - {".txt", ".csv"}
"""Endings of the shapes in a folder, where texts and tables are something else."""


def run_folder(command: TrainCommand) -> None:
    """Train every shape of the folder `command.shape`, and write models, pictures, the table and the page.

    Raises UserError, and KeyboardInterrupt after Ctrl-C, when the trainings so far are saved.
    """
    folder, settings = Path(command.shape), command.settings()
    if command.live:
        raise UserError("--live: not for a folder, whose progress is not for programs; train one shape")
    if flags := command.changed("log", "preview"):
        raise UserError(f"{flags}: not for a folder; train one shape")
    shapes = shapes_in(folder)
    output = _output_folder(command, folder, shapes)
    begin_work()
    let_children_hear_ctrl_c()  # `Runner.stop` presses it
    cores = os.cpu_count() or 1
    threads = 0 if command.jobs == 1 else max(1, cores // command.jobs)
    options = tuple(shape_options(command))
    jobs = [
        Job(name, str(path.resolve()), str((output / (name + SUFFIX)).resolve()), options, command.resume, threads)
        for name, path in shapes.items()
    ]
    finished, waiting = list[Job](), list[Job]()
    for job in jobs:
        (finished if command.resume and _is_finished(job, settings, suited=command.omega is None) else waiting).append(
            job
        )
    rows = [row_of(Outcome(job, Status.KEPT, 0.0)) for job in finished]
    title = f"{folder.resolve().name or 'shapes'}: {len(jobs)} shapes"
    bar = tqdm(total=len(jobs), initial=len(finished), unit="shape", leave=False, disable=command.quiet)
    write_results(output, rows, title, len(waiting))
    with bar, closing(outcomes(waiting, command.jobs, _progress_on(bar))) as ended:
        for outcome in ended:
            row = row_of(outcome)
            rows.append(row)
            _say(row)
            bar.update()
            write_results(output, rows, title, len(jobs) - len(rows))
    _finish(output, rows)


def shapes_in(folder: Path) -> dict[str, Path]:
    """Return the shapes of a folder: name of the model -> file of the shape. Raises UserError where there is none.

    The ending becomes part of the name where files differ in nothing else, `cup-ply` and `cup-obj`, and where the name
    would be that of a checkpoint: `cup.part-ply`.
    """
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in SHAPES and path.is_file())
    if not files:
        raise UserError(f"{show(folder)}: no shapes in that folder; this program reads {known_formats()}")
    stems = [path.stem for path in files]
    named = {
        path.stem
        if stems.count(path.stem) == 1 and not path.stem.endswith(PART)
        else f"{path.stem}-{path.suffix[1:].lower()}": path
        for path in files
    }
    if len(named) < len(files):
        raise UserError(f"{show(folder)}: two shapes have the same name; rename one")
    return named


def shape_options(command: TrainCommand) -> list[str]:
    """Return the options of each shape as arguments, where they are not the default."""
    texture = command.texture if command.image is None else str(command.image.resolve())
    return command_line(replace(command, texture=texture, quiet=False), TrainOptions)


def _output_folder(command: TrainCommand, folder: Path, shapes: dict[str, Path]) -> Path:
    """Check and make the folder of the models. Raises UserError."""
    output = command.output
    if output is None:
        raise UserError(f"{show(folder)} is a folder: name one for its models with -o, or add --time for a motion")
    if output.exists() and not output.is_dir():
        raise UserError(f"cannot write {show(output)}: it is not a folder, and {show(folder)} has many shapes")
    there = [name for name in shapes if (output / (name + SUFFIX)).exists()]
    if there and not (command.resume or command.force):
        raise UserError(
            f"{show(output)}: holds {len(there)} of these models; --resume continues them, --force starts again"
        )
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot write {show(output)}: {error.strerror}") from None
    pictures = {f"{name}.png": kinds.PICTURE for name in shapes}
    for file, kind in ({TABLE: kinds.TABLE, PAGE: kinds.RESULTS} | pictures).items():
        check_writable(output / file, kind=kind, force=None)
    return output


def _is_finished(job: Job, settings: Settings, *, suited: bool) -> bool:
    """Whether an earlier run has finished the training of the same shape with the same settings.

    suited: whether the frequencies are those that suit the shape.
    """
    from .finished_networks import same_training  # loads torch

    with suppress(UserError, OSError):
        model = load(Path(job.output))
        source = model.provenance.get("source") or {}
        sha = hashlib.sha256(Path(job.shape).read_bytes()).hexdigest()
        ended = model.provenance.get("interrupted") is False
        same = same_training(model, settings, but={"omegas"} if suited else set())
        return ended and source.get("sha256") == sha and same
    return False


def _progress_on(bar: "tqdm[NoReturn]") -> Progress:
    def show_progress(name: str, stage: str, fraction: float) -> None:
        bar.set_postfix_str(f"{show(name)}: {stage} {fraction:.0%}", refresh=sys.stderr.isatty())

    return show_progress


def _say(row: Row) -> None:
    if row.status is Status.FAILED:
        tqdm.write(f"{show(row.name)}: failed: {show(row.reason)}")
    elif row.status is Status.TRAINED:
        missing = f"; {show(row.reason)}" if row.reason else ""
        tqdm.write(f"{show(row.name)}: {row.quality()}, {row.seconds} s{missing}")


def _finish(output: Path, rows: Sequence[Row]) -> None:
    """Print the number of models. Raises UserError where no shape became a model, and SystemExit after a signal."""
    if by := ended_by():
        raise SystemExit(128 + by)
    failed = sum(row.status is Status.FAILED for row in rows)
    print(f"{len(rows) - failed} models, {failed} failed: {show(output / PAGE)}, {show(output / TABLE)}")
    if failed == len(rows):
        raise UserError(f"none of the {failed} shapes became a model; {show(output / TABLE)} says why")
