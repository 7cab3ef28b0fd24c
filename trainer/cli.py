"""The verbs `check` and `import` of the command line."""

import json
from dataclasses import dataclass
from pathlib import Path

from ..model.files import check_writable, show
from ..model.gallery import SUFFIX
from ..model.kinds import MODEL
from ..model.options import argument
from ..model.verb import Verb, force_option, output_option
from .commands import CheckCommand
from .openmp import prepare_openmp
from .options import ImportOptions


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
    from ..model.model import size_text
    from ..model.model_file import save
    from .import_authors import import_checkpoints

    model = import_checkpoints(command.checkpoints, command)
    save(model, output)
    for number, level in enumerate(model.levels, start=1):
        print(f"level {number}: {size_text(level.network)}, delta {level.delta:.4g}, slope up to {level.lipschitz:.3g}")
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
