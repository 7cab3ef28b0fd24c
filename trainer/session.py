"""A training from its options to the model: load the shape, choose levels, train with a progress bar, save."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import show
from ..model.interrupts import ended_by
from ..model.model import Model
from ..model.model_file import load, save
from ..model.remarks import remarks
from .callbacks import Preview
from .checkpoint import CheckpointFile
from .machine import device, prepare
from .networks.callback import TrainingProgress
from .networks.snapshot import Snapshot
from .options import TrainingOptions
from .progress import CallingProgress, JsonLines, ProgressCallback, TrainingBar, TrainingLog
from .settings import Settings
from .sources import Source
from .suited_omegas import with_suited_omegas
from .train import ComponentsOfModel, Training


def train(
    source: Source,
    options: TrainingOptions,
    *,
    output: Path | None = None,
    resume: Model | bool = False,
    live: bool = False,
    callback: ProgressCallback | None = None,
    on_level: Callable[[Model], object] | None = None,
    components: ComponentsOfModel | None = None,
    on_read: Callable[[dict[str, Any]], object] | None = None,
    finish: Callable[[Model], Model] | None = None,
) -> Model:
    """Train a model of a shape, and return it. The user's seconds count from now.

    output: model file to write, with checkpoints beside it; None: write no file. resume: a model to continue; True: the
    interrupted training of `output`, or else the model in `output`. live: print progress as JSON, and save after every
    level. callback: receives the progress; its KeyboardInterrupt ends the training, which keeps its weights.
    on_level: receives the model after every level. components: as in `Training`. on_read: receives what was read
    of the shape, and the warnings, for JSON. finish: rounds the weights of a finished model, before it is saved.

    Raises UserError, and KeyboardInterrupt where Ctrl-C came before there was anything to save.
    """
    began = time.perf_counter()
    settings, bar = options.settings(), TrainingBar(options.quiet)
    part = None if output is None else CheckpointFile(output, bar.say)
    previous, snapshot = resume if isinstance(resume, Model) else None, None
    if output is not None and part is not None:
        if options.log is not None and Path(options.log).resolve() == part.path.resolve():
            raise UserError(f"--log {show(options.log)}: that is the file of the training's state; name another")
        previous, snapshot = _interrupted(output, part, bool(resume), bar.say)
    settings = _completed(settings, source, previous)
    progress: TrainingProgress = JsonLines(bar.say) if live else bar
    if callback is not None:
        progress = CallingProgress(progress, callback)
    shape, warnings = source.load(progress, settings.up or source.up)
    prepare(device(settings.device))  # Not before loading: glibc would keep the freed blocks of the mesh.
    if on_read is not None:
        on_read(({} if shape.taken is None else shape.taken.record()) | {"warnings": warnings})
    if shape.taken is not None and not options.quiet:
        progress.say(shape.taken.line())
    for warning in warnings:
        progress.say(f"warning: {warning}")
    if options.omega is None:
        settings = with_suited_omegas(shape, settings, None if options.quiet else progress.say)
    if options.log is not None:
        progress = TrainingLog(progress, Path(options.log), append=previous is not None)
    previews: Sequence[Preview] = [] if on_level is None else [Preview(on_level, bar.say)]
    if live and output is not None:
        previews = [Preview(partial(_save_unfinished, output), bar.say), *previews]
    training = Training(shape, settings, progress, began, part, previews, components=components)
    model = training.run(previous, snapshot)
    for line in remarks(model.provenance):
        progress.say(f"warning: {line}")
    if finish is not None and not training.interrupted:
        try:
            model = finish(model)
        except UserError:
            if output is not None:
                _save(model, output)
            raise
    if output is not None and part is not None:
        _save(model, output)
        if training.interrupted:
            by = ended_by()
            bar.say(f"stopped by {by.name if by else 'Ctrl-C'}; the training so far is saved; --resume continues it")
        else:
            part.remove()
    return model


def _completed(settings: Settings, source: Source, previous: Model | None) -> Settings:
    """Return settings whose missing presentation is that of the model `previous`, and whose `up` is the file's."""
    if previous is not None:
        kept = {key: getattr(settings, key) or getattr(previous, key) for key in ("up", "front", "credit")}
        settings = replace(settings, **kept)
    return replace(settings, up=settings.up or source.up)


def _interrupted(
    output: Path, part: CheckpointFile, resume: bool, say: Callable[[str], None]
) -> tuple[Model | None, Snapshot | None]:
    """Return the model and the state from which to resume, where the user wants that and they exist."""
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
