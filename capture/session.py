"""A run of `mplicits photos`: loads the photographs, trains with a progress bar, saves the model, prints figures."""

from pathlib import Path

from ..model.errors import UserError
from ..model.files import show
from ..model.interrupts import ended_by
from ..model.model import Model, size_text
from ..model.model_file import save
from ..trainer.checkpoint import CheckpointFile
from ..trainer.progress import TrainingBar
from .folder import read_photographs
from .options import PhotoOptions
from .pairing import pairing_line
from .reconstruct import Reconstruction


def reconstruction(
    folder: Path,
    options: PhotoOptions,
    bar: TrainingBar,
    part: CheckpointFile | None = None,
    began: float | None = None,
) -> Reconstruction:
    """Load the photographs of a folder, and print warnings above the bar. part, began: of `Reconstruction`."""
    found, warnings = read_photographs(
        folder, options.scale, options.picture_size, options.ball, options.up, follow=options.follow
    )
    line, doubt = pairing_line(found)
    if not options.quiet:
        bar.say(line)
    for warning in [*warnings, *filter(None, [doubt])]:
        bar.say(f"warning: {warning}")
    return Reconstruction(found, options, bar, part, began)


def photos(folder: Path, options: PhotoOptions) -> Model:
    """Reconstruct photographs with cameras as a model. Raises UserError."""
    return reconstruction(folder, options, TrainingBar(options.quiet)).run()


def run(folder: Path, output: Path, options: PhotoOptions, *, resume: bool, began: float) -> None:
    """Reconstruct photographs as a model in the file `output`.

    resume: continue an interrupted run. began: time.perf_counter() at the start of the user's seconds. Raises
    UserError, and KeyboardInterrupt for Ctrl-C before there is anything to save.
    """
    bar = TrainingBar(options.quiet)
    part = CheckpointFile(output, bar.say)
    left = part.is_there()
    if left and not resume:
        bar.say(f"{show(part.path)} is from an interrupted run; starting again (--resume continues it)")
    if resume and not left:
        raise UserError(f"--resume: {show(part.path)} does not exist")
    work = reconstruction(folder, options, bar, part, began)
    model = work.run(part.read() if resume else None)
    save(model, output)
    if work.interrupted:
        by = ended_by()
        bar.say(f"stopped by {by.name if by else 'Ctrl-C'}; the model so far is saved; --resume continues it")
    else:
        part.remove()
    print(report(model, output))


def report(model: Model, output: Path) -> str:
    """Describe a model of photographs for people."""
    provenance = model.provenance
    source, psnr = provenance["source"], provenance["psnr"]
    width, height = source["size"]
    masks = "with masks" if source["masks"] else "without masks"
    lines = [f"{source['views']} photographs of {width} x {height} pixels, {masks}; {provenance['steps']} steps"]
    lines += [
        f"level {i}: {size_text(level.network)}, delta {level.delta:.4f}"
        for i, level in enumerate(model.levels, start=1)
    ]
    if psnr is not None:
        lines.append(f"{len(source['held_out'])} held out: {psnr:.2f} dB")
    lines.append(f"{show(output)}: {model.parameters()} parameters, {provenance['seconds']:.1f} s")
    return "\n".join(lines)
