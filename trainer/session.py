"""A training from its options to the model: load the shape, complete the settings, train, round, save."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import check_writable, show
from ..model.interrupts import ended_by
from ..model.model import Model
from ..model.model_file import load, save
from ..model.remarks import remarks
from .callbacks import ShowLevels
from .checkpoint import CheckpointFile
from .machine import device, prepare
from .networks.callback import TrainingProgress
from .networks.snapshot import Snapshot
from .options import TrainingOptions
from .progress import CallingProgress, JsonLines, ProgressCallback, TrainingBar, TrainingLog
from .settings import Settings
from .shapes.shape import Shape
from .sources import Source
from .suited_omegas import suited_omegas
from .train import ComponentsOfModel, Training


@dataclass(frozen=True)
class Request:
    """What the caller of a training wants, beside its options."""

    output: Path | None = None
    """Model file to write, with checkpoints beside it; None: write no file."""
    resume: Model | bool = False
    """A model to continue; True: the interrupted training of `output`, or else the model in `output`."""
    live: bool = False
    """Print progress as JSON, and save after every level."""
    callback: ProgressCallback | None = None
    """Receives the progress; its KeyboardInterrupt ends the training, which keeps its weights."""
    previews: Sequence[Callable[[Model], object]] = ()
    """Receive the model after every level, and the finished model."""
    after_level: Callable[[Model], object] | None = None
    """Receives the model after every level."""


@dataclass(frozen=True)
class Finished:
    """The end of a training."""

    model: Model
    """The model as it is saved."""
    exact: Model
    """The model before its weights are rounded; a rounded one lacks some figures."""
    read: dict[str, Any]
    """What was read of the shape, and the warnings, for JSON."""


def make_model(
    source: Source,
    options: TrainingOptions,
    request: Request,
    components: ComponentsOfModel | None = None,
    rounded: Callable[[Model], Model] | None = None,
) -> Finished:
    """Train a model of a shape, and save it. The user's seconds count from now.

    components: as in `Training`. rounded: rounds the weights of a finished model.

    Raises UserError, and KeyboardInterrupt where Ctrl-C came before there was anything to save.
    """
    began, output, bar = time.perf_counter(), request.output, TrainingBar(options.quiet)
    part = None if output is None else _checkpoint(output, options, bar.say)
    previous, snapshot = _interrupted(request, part, bar.say)
    progress: TrainingProgress = JsonLines(bar.say) if request.live else bar
    if request.callback is not None:
        progress = CallingProgress(progress, request.callback)
    up = options.up or (source.up if previous is None else previous.up)
    shape, warnings = source.load(progress, up)
    prepare(device(options.device))  # Not before loading: glibc would keep the freed blocks of the mesh.
    if output is not None:
        check_writable(output)  # it may be a file that the shape names
    if shape.taken is not None and not options.quiet:
        progress.say(shape.taken.line())
    for warning in warnings:
        progress.say(f"warning: {warning}")
    settings = _settings(options, shape, up, previous, progress.say)
    if options.log is not None:
        progress = TrainingLog(progress, Path(options.log), append=previous is not None)
    previews = [ShowLevels(preview, bar.say) for preview in request.previews]
    callbacks = [*previews, *([] if request.after_level is None else [ShowLevels(request.after_level, bar.say)])]
    if request.live and output is not None:
        callbacks.insert(0, ShowLevels(partial(_save_unfinished, output), bar.say))
    training = Training(shape, settings, progress, began, part, callbacks, components=components)
    model = exact = training.run(previous, snapshot)
    for line in remarks(exact.provenance):
        progress.say(f"warning: {line}")
    if rounded is not None and not training.interrupted:
        try:
            model = rounded(exact)
        except UserError:
            if output is not None:
                _save(exact, output)
            raise
    if output is not None and part is not None:
        _save(model, output)
        if training.interrupted:
            by = ended_by()
            bar.say(f"stopped by {by.name if by else 'Ctrl-C'}; the training so far is saved; --resume continues it")
        else:
            part.remove()
        if model is not exact:
            bar.say(f"{show(output)}: {output.stat().st_size:,} bytes, packed")
    for each in previews:
        each.after_level(lambda: model)
    return Finished(model, exact, ({} if shape.taken is None else shape.taken.record()) | {"warnings": warnings})


def _settings(
    options: TrainingOptions, shape: Shape, up: str, previous: Model | None, say: Callable[[str], None]
) -> Settings:
    """Return the user's settings, completed by the frequencies that suit the shape, and the view of `previous`."""
    chosen = options.settings()
    view = (
        {} if previous is None else {key: getattr(chosen, key) or getattr(previous, key) for key in ("front", "credit")}
    )
    if options.omega is None:
        view["omegas"] = suited_omegas(shape, chosen.networks, None if options.quiet else say)
    return replace(chosen, up=up, **view)


def _checkpoint(output: Path, options: TrainingOptions, say: Callable[[str], None]) -> CheckpointFile:
    """Return the file of checkpoints. Raises UserError where --log has its name."""
    part = CheckpointFile(output, say)
    if options.log is not None and Path(options.log).resolve() == part.path.resolve():
        raise UserError(f"--log {show(options.log)}: that is the file of the training's state; name another")
    return part


def _interrupted(
    request: Request, part: CheckpointFile | None, say: Callable[[str], None]
) -> tuple[Model | None, Snapshot | None]:
    """Return the model and the state from which to resume, where the user wants that and they exist."""
    output, resume = request.output, request.resume
    if output is None or part is None:
        return (resume if isinstance(resume, Model) else None), None
    left = part.is_there()
    if left and resume:
        return part.read()
    if left:
        say(f"{show(part.path)} is of an interrupted training; this one starts again (--resume continues it)")
    return (load(output) if resume and output.exists() else None), None


def _save_unfinished(output: Path, model: Model) -> None:
    """Save a model that lacks levels, marked as interrupted."""
    save(replace(model, provenance=model.provenance | {"interrupted": True}), output)


def _save(model: Model, output: Path) -> None:
    """Save the model; where that fails (a full disk), save it in a new temporary folder.

    Raises UserError in that case, which names the file that was written.
    """
    try:
        save(model, output)
    except UserError as error:
        rescue = Path(tempfile.mkdtemp(prefix="mplicits-")) / output.name
        save(model, rescue)
        raise UserError(f"{error}; the trained model is in {show(rescue)}") from None
