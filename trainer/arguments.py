"""The options of trainings on the command line."""

from argparse import ArgumentParser
from pathlib import Path

from ..model.orientation import UPRIGHT
from ..model.verb import output_arguments, take_negative_numbers
from .options import CREASE
from .settings import DEFAULT_PRESET, PRESETS


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
        help="weights of the loss: value, normal, eikonal (Eq. 4), distance (off the surface), "
        "length (times eikonal, on the surface)",
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
