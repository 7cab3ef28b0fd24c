"""Command lines of `train` and `morph`."""

from dataclasses import dataclass
from pathlib import Path

from ..model.endings import CLOUD_NAMES, MESH_NAMES
from ..model.options import Options, argument, option
from ..model.verb import force_option, output_option
from .options import CheckOptions, MorphOptions, TrainOptions

OUTPUT_HELP = "model file (default: the shape's name, in this folder)"
LIVE_HELP = "for programs: progress as lines of JSON on stdout, and the model file is written after every level"
PREVIEW_HELP = "draw a picture of every trained level into this folder"
RESUME_HELP = (
    "continue the interrupted training of NAME.part.safetensors, or else the model in the output file: finish an "
    "interrupted level, add missing levels"
)
SHAPE_HELP = f"a mesh ({MESH_NAMES}), a point cloud ({CLOUD_NAMES}), or the word `demo`"
END_HELP = f"a mesh ({MESH_NAMES}), a model (.safetensors), a name of the gallery, or the word `demo`"


@dataclass(frozen=True)
class FileOptions(Options):
    """Options of the command line that a Python function does not have."""

    output: Path | None = output_option("M.safetensors", OUTPUT_HELP)
    force: bool = force_option()
    resume: bool = option(False, RESUME_HELP, group="files")
    preview: Path | None = option(None, PREVIEW_HELP, metavar="DIR", group="files")
    live: bool = option(False, LIVE_HELP, excludes="quiet", study=True, group="files")
    json: bool = option(
        False, "print one JSON object: the model's figures, and what was read of the shape", group="files"
    )


@dataclass(frozen=True)
class TrainCommand(FileOptions, TrainOptions):
    """Command line of `train`."""

    shape: str = argument(
        "SHAPE",
        SHAPE_HELP + "; or a folder of them, with -o OUT/",
    )
    jobs: int = option(
        1,
        "of a folder: number of shapes to train at the same time",
        metavar="N",
        least=1,
        most=1024,
        group="files",
    )


@dataclass(frozen=True)
class MorphCommand(FileOptions, MorphOptions):
    """Command line of `morph`."""

    first: str = argument("A", f"the shape at t = 0: {END_HELP}")
    second: str = argument("B", "the shape at t = 1, likewise")


@dataclass(frozen=True)
class CheckCommand(CheckOptions):
    """Command line of `check`."""

    shape: str = argument("SHAPE", SHAPE_HELP)
    output: Path | None = output_option("P.png", "draw the shape from two sides; red is seen from inside")
    force: bool = force_option()
    json: bool = option(False, "print one JSON object", group="files")
