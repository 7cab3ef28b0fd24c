"""The verb `demo`: a first look at the program, made of the other verbs."""

import os
import shlex
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from pathlib import Path

from .model.errors import UserError
from .model.files import show
from .model.verb import Verb
from .trainer.options import is_duration

MODEL = "spot"
"""The gallery's model that the demo shows."""
LEVELS, SECONDS = "64x1,64x2", "90"
"""What the demo trains: two levels, so that the picture is there within three minutes on two cores."""

Perform = Callable[[Sequence[str]], None]
"""Runs a command line that begins with a verb."""


def demo_verb(perform: Perform) -> Verb:
    """Make the verb. perform: how it runs the others."""
    return Verb(
        "demo",
        "open Spot, or write its picture, shader and web page; --train: the built-in shape instead",
        demo_arguments,
        "demo",
        lambda args: run_demo(args, perform),
    )


def demo_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `demo` to a parser."""
    parser.add_argument("--train", action="store_true", help="train the built-in shape, where that is not done yet")
    parser.add_argument("--seconds", metavar="S", help=f"train it anew, for S seconds (default {SECONDS})")
    parser.add_argument("--retrain", action="store_true", help="train it anew")
    parser.add_argument("--out-dir", type=Path, default=Path("out"), metavar="DIR", help="where files go (default out)")
    parser.add_argument("--no-window", action="store_true", help="write files, though there is a display")


def run_demo(args: Namespace, perform: Perform) -> None:
    """Run `mplicits demo`: open a model in a window, or where there is no display render and bake it.

    With --train, --seconds or --retrain the model is one of the built-in shape, trained before. Raises UserError.
    """
    model = trained_model(args, perform) if args.train or args.seconds or args.retrain else MODEL
    if not args.no_window and has_display():
        try:
            return announce(perform, "view", model)
        except UserError as error:
            print(f"mplicits: no window: {show(str(error))}", file=sys.stderr)
    make_folder(args.out_dir)
    picture, shader, page = (str(args.out_dir / f"demo.{suffix}") for suffix in ("png", "glsl", "html"))
    announce(perform, "render", model, "--shade", "studio", "-o", picture)
    announce(perform, "bake", model, "--target", "glsl330", "-o", shader)
    announce(perform, "bake", model, "--target", "html", "-o", page)
    print("picture, shader and web page:", *map(show, (picture, shader, page)), sep="\n  ")
    print(f"open {show(page)} in a browser; train a shape of your own: mplicits train SHAPE.ply", flush=True)


def trained_model(args: Namespace, perform: Perform) -> str:
    """Return the path of a model of the built-in shape; train it where it is not there or is wanted anew."""
    if args.seconds and not is_time(args.seconds):
        raise UserError(f"--seconds {show(args.seconds)}: a number from 1 is needed")
    make_folder(args.out_dir)
    model = str(args.out_dir / "demo.safetensors")
    if args.seconds or args.retrain or not is_trained(Path(model)):
        announce(perform, "train", "demo", "-o", model, "--levels", LEVELS, "--seconds", args.seconds or SECONDS)
    else:
        print(f"{show(model)} is there already; --retrain trains it anew", file=sys.stderr)
    return model


def is_time(text: str) -> bool:
    """Whether a text is a number of seconds that `train` takes, so that no folder is made in vain."""
    try:
        return is_duration(float(text))
    except ValueError:
        return False


def make_folder(path: Path) -> None:
    """Make the folder of --out-dir, where it is not there. Raises UserError where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out-dir {show(path)}: {error.strerror}") from None


def announce(perform: Perform, *argv: str) -> None:
    """Print the command line of another verb, then run it."""
    print(f"mplicits {show(shlex.join(argv))}", file=sys.stderr, flush=True)
    perform(argv)


def is_trained(path: Path) -> bool:
    """Whether a file is a model whose training was not cut short."""
    from .model.model_file import load

    try:
        return not load(path).provenance.get("interrupted")
    except UserError:
        return False


def has_display() -> bool:
    """Whether a window can open: Windows and macOS need no environment variable for it."""
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(named) or sys.platform in ("win32", "darwin")
