"""The verbs `train` and `import` of the command line."""

import os
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.errors import UserError
from ..model.files import check_writable, is_folder, show
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import LOG, MODEL
from ..model.verb import Verb, output_arguments
from .arguments import arguments, presentation_arguments
from .options import file_omegas, settings_from
from .settings import Settings, front

if TYPE_CHECKING:
    from ..model.model import Model
    from .last_look import FindsPieces
    from .session import Loader

    MakesPictures = Callable[[Path], Callable[[Model], object]]


def before_torch() -> None:
    """Set up how PyTorch's threads wait; call it before PyTorch is loaded.

    The threads (GNU OpenMP) then wait for one another in a busy loop for microseconds, not milliseconds. Where another
    program runs, a thread that waits so keeps the very thread that it waits for from its core.
    """
    os.environ.setdefault("GOMP_SPINCOUNT", "1000")


def train_verb(
    describe_surface: "Callable[[Model, bool], str]", pictures: "MakesPictures", find: "FindsPieces"
) -> Verb:
    """Make the verb `train`.

    describe_surface: describes the surface of the trained model in a line for people; it is told whether to be quiet.
    pictures: makes, for a folder, what draws a model into it. find: finds loose pieces of a model's surface.
    """
    return Verb(
        "train",
        "a mesh or an oriented point cloud becomes a model file",
        arguments,
        "train bunny.ply -o bunny.safetensors --seconds 60",
        lambda options: run(options, describe_surface, pictures, find),
    )


def run(
    options: Namespace,
    describe_surface: "Callable[[Model, bool], str]",
    pictures: "MakesPictures",
    find: "FindsPieces",
) -> None:
    """Train, save the model, and print its figures. Raises UserError."""
    settings = settings_of(options)
    before_torch()
    if is_folder(Path(options.shape)) and not options.time:
        from .folder import run_folder

        run_folder(options, settings, arguments)
        return
    if options.jobs != 1 or options.cluster:
        raise UserError("--jobs, --cluster: for a folder of shapes")
    if options.time:
        from . import motion

        folder = Path(options.shape)
        paths, crease = motion.frames(folder), None if options.flat else options.crease
        load = motion.frames_loader(folder, paths, up=options.up, crease=crease)
        train(options, settings, describe_surface, pictures, options.shape, paths, load)
        return
    from ..model.mesh_file import mesh_files

    image = None if options.texture in ("auto", "none") else Path(options.texture)
    reads = [*mesh_files(Path(options.shape)), *([] if image is None else [image])]
    train(options, settings, describe_surface, pictures, options.shape, reads, image=image, find=find)


def settings_of(options: Namespace) -> Settings:
    """Make the settings of what the user chose. Raises UserError."""
    taken = signature(settings_from).parameters
    return settings_from(**{name: value for name, value in vars(options).items() if name in taken})


def train(
    options: Namespace,
    settings: Settings,
    describe_surface: "Callable[[Model, bool], str]",
    pictures: "MakesPictures",
    name: str,
    reads: list[Path],
    load_moving: "Loader | None" = None,
    image: Path | None = None,
    find: "FindsPieces | None" = None,
) -> None:
    """Train the shape `name`, or the one that `load_moving` makes, as `session.run` does, and print what came of it.

    reads: the files that it comes from. Raises UserError.
    """
    output = options.output or Path(Path(name).stem + SUFFIX)
    check_writable(output, reads, kind=MODEL, force=options.force)
    if options.log is not None:
        if options.log.resolve() == output.resolve():
            raise UserError(f"--log {show(options.log)}: that is the model file; name another")
        check_writable(options.log, reads, kind=LOG)
    draw = None if not options.preview else pictures(options.preview)
    from . import session

    begin_work(termination=not options.live)
    model = session.run(
        name,
        output,
        settings,
        image=image,
        resume=options.resume,
        quiet=options.quiet,
        live=options.live,
        crease=None if options.flat else options.crease,
        thicken=getattr(options, "thicken", None),
        load_moving=load_moving,
        began=time.perf_counter(),
        log=options.log,
        follow=draw,
        find=find,
    )
    if draw is not None:
        draw(model)
    if by := ended_by():
        raise SystemExit(128 + by)
    if not (options.live or model.provenance["interrupted"]):
        print(describe_surface(model, options.quiet))


def import_arguments(parser: ArgumentParser) -> None:
    """Add the options of `import`."""
    add = parser.add_argument
    add(
        "checkpoints", metavar="FILE.pth", nargs="+", type=Path, help="networks of the authors' release, coarse to fine"
    )
    output_arguments(parser, "M.safetensors", "the model file (default: the last checkpoint's name, in this folder)")
    add("--omega", metavar="W,..", help="omega_0 of each file, for files that lack it (*_with_w0.pth)")
    add(
        "--shape",
        metavar="SHAPE",
        help="the shape that they were trained on: its points give the bands, its coordinates the "
        "model's; without it, the last level's surface gives the bands",
    )
    presentation_arguments(parser)


def run_import(options: Namespace) -> None:
    """Read checkpoints, measure bands and slopes, and write the model. Raises UserError."""
    file_omegas(options.omega, len(options.checkpoints))
    front(options.front)
    before_torch()
    from ..model.mesh_file import mesh_files

    output = options.output or Path(options.checkpoints[-1].stem + SUFFIX)
    reads = [*options.checkpoints, *([] if options.shape is None else mesh_files(Path(options.shape)))]
    check_writable(output, reads, kind=MODEL, force=options.force)
    from ..model.model import shape_of
    from ..model.model_file import save
    from .imported import import_checkpoints

    model = import_checkpoints(options.checkpoints, options.omega, options.shape, options.front, options.credit)
    save(model, output)
    for number, level in enumerate(model.levels, start=1):
        print(f"level {number}: {shape_of(level.network)}, delta {level.delta:.4g}, slope up to {level.lipschitz:.3g}")
    print(f"{show(output)}: {model.parameters()} parameters")


VERBS = (
    Verb(
        "import",
        "checkpoints of the paper's authors become a model file",
        import_arguments,
        "import coarse.pth fine.pth -o model.safetensors",
        run_import,
    ),
)
