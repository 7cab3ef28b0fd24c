"""One run of `mplicits photos`: read the photographs, learn with a progress bar, save the model, print the figures."""

from pathlib import Path

from ..model.errors import UserError
from ..model.files import show
from ..model.interrupts import ended_by
from ..model.model import Model, shape_of
from ..model.model_file import save
from ..trainer.part import Part
from ..trainer.session import TrainingBar
from .folder import read_photographs
from .options import PhotoOptions
from .photo_settings import PhotoSettings, photo_settings
from .posed import Photographs
from .reconstruct import Reconstruction


def photographs_of(folder: Path, settings: PhotoSettings, bar: TrainingBar) -> Photographs:
    """Read the photographs as the settings say; warnings go to the bar. Raises UserError."""
    found, warnings = read_photographs(folder, settings.scale, settings.camera_size, settings.sphere, settings.up)
    for warning in warnings:
        bar.say(f"warning: {warning}")
    return found


def photos(folder: Path, options: PhotoOptions) -> Model:
    """Make a model of photographs with cameras. Raises UserError."""
    settings = photo_settings(options)
    bar = TrainingBar(options.quiet)
    return Reconstruction(photographs_of(folder, settings, bar), settings, bar).run()


def run(folder: Path, output: Path, settings: PhotoSettings, *, resume: bool, quiet: bool, began: float) -> None:
    """Make a model of photographs and write it to `output`.

    resume: go on with what was cut short. began: the value of time.perf_counter() from which on the user's seconds
    count. Raises UserError, and KeyboardInterrupt where Ctrl-C came before there was anything to save.
    """
    bar = TrainingBar(quiet)
    part = Part(output, bar.say)
    left = part.is_there()
    if left and not resume:
        bar.say(f"{show(part.path)} is of what was cut short; this one begins anew (--resume goes on with it)")
    if resume and not left:
        raise UserError(f"--resume: there is no {show(part.path)} to go on with")
    reconstruction = Reconstruction(photographs_of(folder, settings, bar), settings, bar, part, began)
    model = reconstruction.run(part.read() if resume else None)
    save(model, output)
    if reconstruction.interrupted:
        by = ended_by()
        bar.say(f"stopped by {by.name if by else 'Ctrl-C'}; what is learnt so far is saved; go on with --resume")
    else:
        part.remove()
    print(report(model, output))


def report(model: Model, output: Path) -> str:
    """Describe a model of photographs for people."""
    provenance = model.provenance
    source = provenance["source"]
    held, psnr = len(source["held_out"]), provenance["psnr"]
    width, height = source["size"]
    masks = "with masks" if source["masks"] else "without masks"
    lines = [f"{source['views']} photographs of {width} x {height} pixels, {masks}; {provenance['steps']} steps"]
    lines += [
        f"level {i}: {shape_of(level.network)}, delta {level.delta:.4f}"
        for i, level in enumerate(model.levels, start=1)
    ]
    if psnr is not None:
        lines.append(f"{held} held out: {psnr:.2f} dB")
    lines.append(f"{show(output)}: {model.parameters()} parameters, {provenance['seconds']:.1f} s")
    return "\n".join(lines)
