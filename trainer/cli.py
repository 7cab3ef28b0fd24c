"""The verbs `train`, `morph` and `import` of the command line."""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..model.errors import UserError
from ..model.files import check_writable, is_folder, show
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import LOG, MODEL
from ..model.options import argument
from ..model.verb import Verb, force_option, output_option
from .commands import CheckCommand, FileOptions, MorphCommand, TrainCommand
from .openmp import prepare_openmp
from .options import ImportOptions, TrainingOptions

if TYPE_CHECKING:
    from ..model.model import Model
    from .sources import ModelSurface, Source
    from .train import ComponentsOfModel


@dataclass(frozen=True)
class Hooks:
    """Functions of other rooms that a training calls; the front door passes them on."""

    describe_surface: "Callable[[Model, bool], str]"
    """Describes the surface of a model in a line. The second argument is --quiet."""
    loose_components: "ComponentsOfModel"
    """Finds the loose components of a model's surface, for the training to remove."""
    surface_of: "Callable[[Model, bool], ModelSurface]"
    """Extracts the surface of a model. The second argument is --quiet."""
    pack: "Callable[[Model, str | float], Model]"
    """Rounds the weights to few bits. The second argument is --bits."""
    pictures: "Callable[[Path], Callable[[Model], object]]"
    """Returns a function that draws a model into a folder."""


def training_verbs(hooks: Hooks) -> tuple[Verb, Verb]:
    """Return the verbs `train` and `morph`."""
    return (
        Verb(
            "train",
            "a mesh or an oriented point cloud becomes a model file",
            TrainCommand,
            "train bunny.ply -o bunny.safetensors --seconds 60",
            lambda command: _train(command, hooks),
        ),
        Verb(
            "morph",
            "one shape becomes another while time goes by",
            MorphCommand,
            "morph spot bob -o spot-to-bob.safetensors",
            lambda command: _morph(command, hooks),
        ),
    )


def _train(command: TrainCommand, hooks: Hooks) -> None:
    """Train a model of a shape, or of every shape of a folder. Raises UserError."""
    command.settings()
    prepare_openmp()
    if is_folder(Path(command.shape)) and not command.time:
        from .folder import run_folder

        run_folder(command)
        return
    if flags := command.changed("jobs", "cluster"):
        raise UserError(f"{flags}: for a folder of shapes")
    from .sources import frames_source, shape_source

    source = frames_source(command.shape, command) if command.time else shape_source(command.shape, command)
    _run(command, command, source, hooks, command.bits)


def _morph(command: MorphCommand, hooks: Hooks) -> None:
    """Train the motion from A to B. Raises UserError."""
    command.settings()
    prepare_openmp()
    from .sources import morph_source

    def surface_of(model: "Model") -> "ModelSurface":
        return hooks.surface_of(model, command.quiet)

    source = morph_source(command.first, command.second, surface_of, command)
    _run(command, command, source, hooks)


def _run(
    files: FileOptions, options: TrainingOptions, source: "Source", hooks: Hooks, bits: str | float | None = None
) -> None:
    """Train, write the model, and print its summary. bits: of --bits. Raises UserError."""
    output = files.output or Path(source.stem + SUFFIX)
    check_writable(output, source.files, kind=MODEL, force=files.force)
    if options.log is not None:
        log = Path(options.log)
        if log.resolve() == output.resolve():
            raise UserError(f"--log {show(log)}: that is the model file; name another")
        check_writable(log, source.files, kind=LOG)
    draw = None if files.preview is None else hooks.pictures(files.preview)
    from .callbacks import Preview
    from .session import train
    from .summary import figures, summary

    begin_work(termination=not files.live)
    read: dict[str, Any] = {}

    def on_read(facts: dict[str, Any]) -> None:
        check_writable(output)  # it may be a file that the shape names
        read.update(facts)

    exact: list[Model] = []

    def finish(model: "Model") -> "Model":
        exact.append(model)
        return model if bits is None else hooks.pack(model, bits)

    model = train(
        source,
        options,
        output=output,
        resume=files.resume,
        live=files.live,
        on_level=draw,
        components=hooks.loose_components,
        on_read=on_read,
        finish=finish,
    )
    if bits is not None and not model.provenance["interrupted"]:
        print(f"{show(output)}: {output.stat().st_size:,} bytes, packed", file=sys.stderr)
    trained = exact[0] if exact else model  # a packed file lacks some figures
    if files.json:
        print(json.dumps(figures(trained, output) | {"input": read}))
    else:
        print(summary(trained, output))
    if draw is not None:
        Preview(draw, lambda line: print(line, file=sys.stderr)).after_level(lambda: model)
    if by := ended_by():
        raise SystemExit(128 + by)
    if not (files.live or files.json or model.provenance["interrupted"]):
        print(hooks.describe_surface(model, options.quiet))


def _check(command: CheckCommand) -> None:
    """Print what a training would read of a shape, and its warnings; draw it with -o. Raises UserError."""
    from ..model.files import write_whole
    from ..model.kinds import PICTURE

    if command.output is not None:
        check_writable(command.output, [Path(command.shape)], kind=PICTURE, force=command.force)
    from .check import check

    found = check(command.shape, command)
    if command.output is not None:
        from ..model.image_file import png_bytes

        write_whole(command.output, png_bytes(found.picture()))
    if command.json:
        print(json.dumps(found.facts, indent=2))
        return
    print(show(found.line))
    for line in found.warnings:
        print(f"warning: {show(line)}")


@dataclass(frozen=True)
class ImportCommand(ImportOptions):
    """Command line of `import`."""

    checkpoints: list[Path] = argument("FILE.pth", "networks of the authors' release, coarse to fine", Path)
    output: Path | None = output_option(
        "M.safetensors", "model file (default: the last checkpoint's name, in this folder)"
    )
    force: bool = force_option()


def _import(command: ImportCommand) -> None:
    """Read checkpoints, measure bands and slopes, and write the model. Raises UserError."""
    command.omegas(len(command.checkpoints))
    command.view()
    prepare_openmp()
    output = command.output or Path(command.checkpoints[-1].stem + SUFFIX)
    reads = [*command.checkpoints, *([] if command.shape is None else [Path(command.shape)])]
    check_writable(output, reads, kind=MODEL, force=command.force)
    from ..model.model import shape_of
    from ..model.model_file import save
    from .import_authors import import_checkpoints

    model = import_checkpoints(command.checkpoints, command)
    save(model, output)
    for number, level in enumerate(model.levels, start=1):
        print(f"level {number}: {shape_of(level.network)}, delta {level.delta:.4g}, slope up to {level.lipschitz:.3g}")
    print(f"{show(output)}: {model.parameters()} parameters")


VERBS = (
    Verb(
        "check",
        "what a training would read of a shape: one line, its warnings, a picture",
        CheckCommand,
        "check soldier.glb -o soldier.png",
        _check,
        "mesh",
    ),
    Verb(
        "import",
        "checkpoints of the paper's authors become a model file",
        ImportCommand,
        "import coarse.pth fine.pth -o model.safetensors",
        _import,
    ),
)
