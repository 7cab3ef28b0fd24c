"""The verbs `train` and `import` of the command line."""

import os
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.errors import UserError
from ..model.files import check_writable, show
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import LOG, MODEL
from ..model.orientation import UPRIGHT
from ..model.verb import Verb, output_arguments, take_negative_numbers
from .options import CREASE, file_omegas, settings_from
from .settings import DEFAULT_PRESET, PRESETS, Settings, front

if TYPE_CHECKING:
    from ..model.model import Model
    from .session import MovingLoader

    MakesPictures = Callable[[Path], Callable[[Model], object]]


def arguments(parser: ArgumentParser) -> None:
    """Add the options of `train`."""
    parser.add_argument(
        "shape",
        metavar="SHAPE",
        help="a mesh (PLY OBJ STL GLB), a point cloud (PLY XYZ NPZ OBJ), or the word `demo`; or a folder of them, "
        "with -o OUT/",
    )
    parser.add_argument(
        "--time",
        action="store_true",
        help="SHAPE is a folder of meshes, which are moments of one motion: sorted by name, evenly spaced while t goes "
        "from 0 to 1",
    )
    parser.add_argument(
        "--noise",
        metavar="S",
        type=float,
        help="standard deviation of a cloud's points, as a share of the shape's radius: 0.01; "
        "0: the points are exact, and none is an outlier (default: measured)",
    )
    parser.add_argument(
        "--thicken",
        metavar="T",
        type=float,
        help="take an open mesh for a sheet: all that is nearer to it than T, a share of its radius (0.02)",
    )
    parser.add_argument(
        "--jobs", metavar="N", type=int, default=1, help="of a folder: shapes trained beside one another (default: 1)"
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="of a folder: train on the workers of the Dask scheduler there (tcp://host:8786), which see its files",
    )
    training_arguments(parser)


def training_arguments(parser: ArgumentParser) -> None:
    """Add the options that every training has."""
    add = parser.add_argument
    output_arguments(parser, "M.safetensors", "the model file (default: the shape's name, in this folder)")
    add(
        "--levels",
        metavar="NxD,..|auto",
        help="width and hidden layers of each level, coarse to fine: 64x1,64x2,128x2; "
        "auto: chosen by short trials, by one of --parameters, --kilobytes, --error",
    )
    add("--parameters", metavar="N", type=int, help="with --levels auto: most parameters of the model")
    add("--kilobytes", metavar="K", type=float, help="with --levels auto: size of the model file, at most")
    add("--error", metavar="E", type=float, help="with --levels auto: mean |f| on the surface, in radii of the shape")
    presets = "; ".join(f"{name} = {preset.levels}{' --packed' * preset.packed}" for name, preset in PRESETS.items())
    add(
        "--preset",
        choices=PRESETS,
        default=DEFAULT_PRESET,
        help=f"levels by name: {presets} (default: {DEFAULT_PRESET})",
    )
    add(
        "--packed",
        action="store_true",
        help="quantise the weights to a few bits, for short shader texts (bake --target shadertoy)",
    )
    add(
        "--omega",
        metavar="W,..",
        help="omega_0 of each level (default: 40,80,120; less below 64 wide), then of the texture (default: 50)",
    )
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--seconds", metavar="S", type=float, help="seconds of wall time for the whole training")
    length.add_argument(
        "--steps",
        metavar="N,..",
        help="optimiser steps of each level, then of the texture (the same seed and steps give the same weights)",
    )
    add(
        "--texture",
        metavar="auto|none|FILE",
        default="auto",
        help="auto: learn colours where the shape has them, "
        "of a material's image, of vertices or points; none: geometry alone; FILE: an image, by texture coordinates",
    )
    add(
        "--texture-network",
        metavar="NxD",
        help="width and hidden layers of the texture (default: those of the last level, 64x2 at most)",
    )
    facets = parser.add_mutually_exclusive_group()
    facets.add_argument(
        "--crease",
        metavar="DEG",
        type=float,
        default=CREASE,
        help="a mesh stands for a curved surface, smooth but for edges that bend by more than this angle where those "
        f"beside them do not (default: {CREASE:g}); normals in the file have the last word",
    )
    facets.add_argument("--flat", action="store_true", help="keep a mesh's faces flat, and every edge sharp")
    add(
        "--up",
        choices=UPRIGHT,
        help="axis of the shape's file that points up (default: y, or what the file's format says)",
    )
    presentation_arguments(parser)
    add("--seed", metavar="K", type=int, default=0, help="seed of all random numbers (default: 0)")
    add(
        "--resume",
        action="store_true",
        help="go on with a training that was cut short, from NAME.part.safetensors; "
        "else with the output file: finish an interrupted level, add missing ones",
    )
    add(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="where to train (default: auto, a CUDA device if there is one)",
    )
    add(
        "--log",
        metavar="FILE.jsonl",
        type=Path,
        help="write how the training goes: a line of JSON with the loss, its terms, and mean |f| at held-out points",
    )
    add(
        "--preview",
        metavar="DIR",
        type=Path,
        default=False,
        help="draw a picture of every level into this folder as soon as it is trained",
    )
    add(
        "--weights",
        metavar="NAME=X,..",
        help="weights of the loss: value, normal, eikonal (Eq. 4), distance (off the surface)",
    )
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--quiet", action="store_true", help="show no progress bar")
    shown.add_argument(
        "--live",
        action="store_true",
        help="for programs: progress as lines of JSON on stdout, and the model file is written after every level",
    )


def presentation_arguments(parser: ArgumentParser) -> None:
    """Add the options that say how a model is presented, which the model file keeps."""
    take_negative_numbers(parser)
    parser.add_argument(
        "--front",
        metavar="AZ,EL",
        help="the first view of the model: degrees around, 0 from +z and 90 from +x, and degrees above",
    )
    parser.add_argument("--credit", metavar="TEXT", help="author and licence of the shape: 'Keenan Crane, CC0'")


def before_torch() -> None:
    """Set up how PyTorch's threads wait; call it before PyTorch is loaded.

    The threads (GNU OpenMP) then wait for one another in a busy loop for microseconds, not milliseconds. Where another
    program runs, a thread that waits so keeps the very thread that it waits for from its core.
    """
    os.environ.setdefault("GOMP_SPINCOUNT", "1000")


def train_verb(describe_surface: "Callable[[Model, bool], str]", pictures: "MakesPictures") -> Verb:
    """Make the verb `train`.

    describe_surface: describes the surface of the trained model in a line for people; it is told whether to be quiet.
    pictures: makes, for a folder, what draws a model into it.
    """
    return Verb(
        "train",
        "a mesh or an oriented point cloud becomes a model file",
        arguments,
        "train bunny.ply -o bunny.safetensors --seconds 60",
        lambda options: run(options, describe_surface, pictures),
    )


def run(options: Namespace, describe_surface: "Callable[[Model, bool], str]", pictures: "MakesPictures") -> None:
    """Train, save the model, and print its figures. Raises UserError."""
    settings = settings_of(options)
    before_torch()
    if Path(options.shape).is_dir() and not options.time:
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
    train(options, settings, describe_surface, pictures, options.shape, reads, image=image)


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
    load_moving: "MovingLoader | None" = None,
    image: Path | None = None,
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
    from ..model.model import save, shape_of
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
