"""The verb `demo`, which runs other verbs."""

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .model.errors import UserError
from .model.files import show
from .model.options import Options, option
from .model.verb import Verb
from .trainer.options import MOST_SECONDS

MODEL = "spot"
"""Name of the demo's model in the gallery."""
LEVELS, SECONDS = "64x1,64x2", 90
"""Training of --train: two levels, done within three minutes on two cores."""

Perform = Callable[[Sequence[str]], None]
"""Runs a command line that begins with a verb."""


@dataclass(frozen=True)
class DemoCommand(Options):
    """Command line of `demo`."""

    train: bool = option(False, "train the built-in shape, unless its model exists")
    seconds: float | None = option(
        None,
        f"with --train: train it anew, for S seconds (default: {SECONDS})",
        metavar="S",
        least=1,
        most=MOST_SECONDS,
    )
    out_dir: Path = option(Path("out"), "folder of the files", metavar="DIR")
    no_window: bool = option(False, "write files, even with a display")


def demo_verb(perform: Perform) -> Verb:
    """Return the verb. perform: runs the other verbs."""
    return Verb(
        "demo",
        "open Spot, or write its picture, shader and web page; --train: the built-in shape instead",
        DemoCommand,
        "demo",
        lambda command: run_demo(command, perform),
    )


def run_demo(command: DemoCommand, perform: Perform) -> None:
    """Open a model in a window, or render and bake it without a display. Raises UserError.

    With --train it is a model of the built-in shape.
    """
    if command.seconds and not command.train:
        raise UserError("--seconds: needs --train")
    model = trained_model(command, perform) if command.train else MODEL
    if not command.no_window and has_display():
        try:
            return announce(perform, "view", model)
        except UserError as error:
            print(f"mplicits: no window: {show(str(error))}", file=sys.stderr)
    make_folder(command.out_dir)
    picture, shader, page = (str(command.out_dir / f"demo.{suffix}") for suffix in ("png", "glsl", "html"))
    announce(perform, "render", model, "--shade", "softbox", "-o", picture)
    announce(perform, "bake", model, "--target", "glsl330", "-o", shader)
    announce(perform, "bake", model, "--target", "html", "-o", page)
    print("picture, shader and web page:", *map(show, (picture, shader, page)), sep="\n  ")
    print(f"open {show(page)} in a browser; train a shape of your own: mplicits train SHAPE.ply", flush=True)


def trained_model(command: DemoCommand, perform: Perform) -> str:
    """Return the path of a model of the built-in shape, and train it if necessary."""
    make_folder(command.out_dir)
    model = str(command.out_dir / "demo.safetensors")
    if command.seconds or not is_trained(Path(model)):
        seconds = f"{command.seconds or SECONDS:g}"
        announce(perform, "train", "demo", "-o", model, "--levels", LEVELS, "--seconds", seconds)
    else:
        print(f"{show(model)} exists; --train --seconds {SECONDS} trains it anew", file=sys.stderr)
    return model


def make_folder(path: Path) -> None:
    """Make the folder of --out-dir if it does not exist. Raises UserError where that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out-dir {show(path)}: {error.strerror}") from None


def announce(perform: Perform, *argv: str) -> None:
    """Print the command line of another verb, then run it."""
    print(f"mplicits {show(shlex.join(argv))}", file=sys.stderr, flush=True)
    perform(argv)


def is_trained(path: Path) -> bool:
    """Whether a file is a model whose training was not interrupted."""
    from .model.model_file import load

    try:
        return not load(path).provenance.get("interrupted")
    except UserError:
        return False


def has_display() -> bool:
    """Whether a window can open: Windows and macOS need no environment variable for it."""
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(named) or sys.platform in ("win32", "darwin")
