"""`mplicits train DIR -o OUT/`: every shape of a folder becomes a model, with a table and a page of all of them."""

import hashlib
import os
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from ..model.errors import UserError
from ..model.files import show
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.model_file import load
from .folders.job import Job, Outcome, Progress, Status
from .folders.results import PAGE, TABLE, Row, row_of, write_results
from .folders.workers import here, on_cluster
from .settings import Settings
from .shapes.load import READERS

MOST_JOBS = 1024
OWN = {"log", "preview", "shape", "output", "force", "resume", "quiet", "live", "jobs", "cluster", "time", "help"}
"""Options that are not each shape's."""


def run_folder(options: Namespace, settings: Settings, arguments: Callable[[ArgumentParser], None]) -> None:
    """Train every shape of the folder `options.shape`, and write models, pictures, the table and the page.

    settings: what the options mean, checked. arguments: adds the options of `train` to a parser. Raises UserError, and
    KeyboardInterrupt after Ctrl-C, when all that is learnt is saved.
    """
    folder, output = Path(options.shape), options.output
    if options.live:
        raise UserError("--live: a folder's progress is not for programs; follow one shape")
    if options.log or options.preview:
        raise UserError("--log, --preview: of one shape, not of a folder")
    if not 1 <= options.jobs <= MOST_JOBS:
        raise UserError(f"--jobs {options.jobs}: a whole number from 1 to {MOST_JOBS} is needed")
    shapes = shapes_in(folder)
    output = _folder_for(output, folder, shapes, options)
    begin_work()
    cores = os.cpu_count() or 1
    threads = 1 if options.cluster else 0 if options.jobs == 1 else max(1, cores // options.jobs)
    passed = tuple(passed_on(options, arguments))
    jobs = [
        Job(name, str(path.resolve()), str((output / (name + SUFFIX)).resolve()), passed, options.resume, threads)
        for name, path in shapes.items()
    ]
    kept, waiting = list[Job](), list[Job]()
    for job in jobs:
        (kept if options.resume and _is_done(job, settings) else waiting).append(job)
    rows = [row_of(Outcome(job, Status.KEPT, 0.0)) for job in kept]
    title = f"{folder.resolve().name or 'shapes'}: {len(jobs)} shapes"
    bar = tqdm(total=len(jobs), initial=len(kept), unit="shape", disable=options.quiet)
    write_results(output, rows, title, len(waiting))
    with bar, closing(_outcomes(waiting, options, _shown_on(bar))) as outcomes:
        for outcome in outcomes:
            row = row_of(outcome)
            rows.append(row)
            _say(row)
            bar.update()
            write_results(output, rows, title, len(jobs) - len(rows))
    _end(output, rows)


def shapes_in(folder: Path) -> dict[str, Path]:
    """Find the shapes of a folder: the name that each one's model has -> its file. Raises UserError where it has none.

    Two files that differ in their endings alone keep those: `cup.ply` and `cup.obj` become `cup-ply` and `cup-obj`.
    """
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in READERS and path.is_file())
    if not files:
        known = " ".join(suffix[1:].upper() for suffix in READERS)
        raise UserError(f"{show(folder)}: no shapes in that folder; this program reads {known}")
    stems = [path.stem for path in files]
    named = {
        path.stem if stems.count(path.stem) == 1 else f"{path.stem}-{path.suffix[1:].lower()}": path for path in files
    }
    if len(named) < len(files):
        raise UserError(f"{show(folder)}: two shapes of one name; give them names of their own")
    return named


def passed_on(options: Namespace, arguments: Callable[[ArgumentParser], None]) -> Iterator[str]:
    """Write those of the options that are each shape's own, as on the command line, where they are not the default."""
    parser = ArgumentParser()
    arguments(parser)
    for action in parser._actions:
        if action.dest in OWN or not action.option_strings:
            continue
        value = getattr(options, action.dest)
        if value == action.default:
            continue
        if action.dest == "texture" and value != "none":
            value = Path(value).resolve()
        yield action.option_strings[-1] if action.nargs == 0 else f"{action.option_strings[-1]}={value}"


def _folder_for(output: Path | None, folder: Path, shapes: dict[str, Path], options: Namespace) -> Path:
    """Check and make the folder that models go to. Raises UserError."""
    if output is None:
        raise UserError(f"{show(folder)} is a folder: name one for its models with -o, or say --time for a motion")
    if output.exists() and not output.is_dir():
        raise UserError(f"cannot write {show(output)}: it is no folder, and {show(folder)} has many shapes")
    there = [name for name in shapes if (output / (name + SUFFIX)).exists()]
    if there and not (options.resume or options.force):
        raise UserError(
            f"{show(output)}: holds {len(there)} of these models; --resume goes on with them, --force begins anew"
        )
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot write {show(output)}: {error.strerror}") from None
    return output


def _is_done(job: Job, settings: Settings) -> bool:
    """Whether an earlier run has trained this very shape with these settings to the end."""
    from .automatic import as_before  # loads torch
    from .trained import same_training

    with suppress(UserError, OSError):
        model = load(Path(job.output))
        source = model.provenance.get("source") or {}
        sha = hashlib.sha256(Path(job.shape).read_bytes()).hexdigest()
        ended = model.provenance.get("interrupted") is False
        return ended and source.get("sha256") == sha and same_training(model, as_before(settings, model))
    return False


def _outcomes(jobs: Sequence[Job], options: Namespace, progress: Progress) -> Generator[Outcome]:
    return on_cluster(jobs, options.cluster) if options.cluster else here(jobs, options.jobs, progress)


def _shown_on(bar: "tqdm[NoReturn]") -> Progress:
    def hear(name: str, stage: str, fraction: float) -> None:
        bar.set_postfix_str(f"{show(name)}: {stage} {fraction:.0%}", refresh=sys.stderr.isatty())

    return hear


def _say(row: Row) -> None:
    if row.status is Status.FAILED:
        tqdm.write(f"{show(row.name)}: failed: {show(row.reason)}")
    elif row.status is Status.TRAINED:
        missing = f"; {show(row.reason)}" if row.reason else ""
        tqdm.write(f"{show(row.name)}: mean |f| {row.mean_f:.2e}, {row.angle} degrees, {row.seconds} s{missing}")


def _end(output: Path, rows: Sequence[Row]) -> None:
    """Say what came of all. Raises UserError where no shape became a model, and SystemExit after a signal."""
    if by := ended_by():
        raise SystemExit(128 + by)
    failed = sum(row.status is Status.FAILED for row in rows)
    print(f"{len(rows) - failed} models, {failed} failed: {show(output / PAGE)}, {show(output / TABLE)}")
    if failed == len(rows):
        raise UserError(f"none of the {failed} shapes became a model; {show(output / TABLE)} says why")
