"""The front door: one command, a verb for each thing the rooms can do."""

import argparse
import importlib
import io
import os
import shlex
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

from .model.errors import UserError
from .model.files import show
from .model.verb import Verb

ROOMS = ("trainer", "codegen", "viewer", "mesher")
"""Folders whose cli.py declares VERBS, in the order of the help."""

EXTRAS = {
    "train": {"igl", "lxml", "networkx", "scipy", "torch", "trimesh"},
    "mesh": {"igl", "lxml", "networkx", "scipy", "threadpoolctl", "trimesh"},
}
"""Extra -> modules it brings."""
MESHING = ("mesh", "eval")
"""Verbs that need the extra `mesh`; others that need one need `train`."""
PACKAGES = {"PIL": "pillow"}
"""Package of a module, where the names differ."""

DEMO_MODEL = "spot"
"""The gallery's model that the demo opens."""
DEMO_LEVELS, DEMO_SECONDS = "64x1,64x2", "90"
"""What the demo trains: two levels, so that the picture is there within three minutes on two cores."""

ABOUT = "A mesh or an oriented point cloud becomes a small multiscale neural SDF, baked into shaders."
EXAMPLE = "example: mplicits train bunny.ply -o bunny.safetensors"


class Parser(argparse.ArgumentParser):
    """An argument parser whose complaints are one line."""

    def error(self, message: str) -> NoReturn:
        """Raises UserError with argparse's message and where to read on."""
        raise UserError(f"{message} (see {self.prog} --help)")


def demo_arguments(parser: argparse.ArgumentParser) -> None:
    """Fills the parser of `demo`."""
    parser.add_argument("--train", action="store_true", help="train the built-in shape, where that is not done yet")
    parser.add_argument("--seconds", metavar="S", help=f"train it anew, for S seconds (default {DEMO_SECONDS})")
    parser.add_argument("--retrain", action="store_true", help="train it anew")
    parser.add_argument("--out-dir", type=Path, default=Path("out"), metavar="DIR", help="where files go (default out)")
    parser.add_argument("--no-window", action="store_true", help="write files, though there is a display")


def run_demo(args: argparse.Namespace) -> None:
    """`mplicits demo`: view, or where there is no display render and bake; with --train, train before."""
    model = demo_model(args) if args.train or args.seconds or args.retrain else DEMO_MODEL
    if not args.no_window and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        try:
            return announce("view", model)
        except UserError as error:
            print(f"mplicits: no window: {show(str(error))}", file=sys.stderr)
    make_folder(args.out_dir)
    picture, shader, page = (str(args.out_dir / f"demo.{end}") for end in ("png", "glsl", "html"))
    announce("render", model, "-o", picture)
    announce("bake", model, "--target", "glsl330", "-o", shader)
    announce("bake", model, "--target", "html", "-o", page)
    print("picture, shader and web page:", *map(show, (picture, shader, page)), sep="\n  ", flush=True)


def demo_model(args: argparse.Namespace) -> str:
    """The model of the built-in shape: trained, where it is not there or shall be anew."""
    make_folder(args.out_dir)
    model = str(args.out_dir / "demo.safetensors")
    if args.seconds or args.retrain or not is_trained(Path(model)):
        announce("train", "demo", "-o", model, "--levels", DEMO_LEVELS, "--seconds", args.seconds or DEMO_SECONDS)
    else:
        print(f"{show(model)} is there already; --retrain trains it anew", file=sys.stderr)
    return model


def make_folder(path: Path) -> None:
    """Of --out-dir. Raises UserError where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out-dir {show(path)}: {error.strerror}") from None


def announce(*argv: str) -> None:
    """Runs a command line of one verb, which it prints first."""
    print(f"mplicits {show(shlex.join(argv))}", file=sys.stderr, flush=True)
    perform(argv)


def is_trained(path: Path) -> bool:
    """Whether `path` is a model whose training was not cut short."""
    from .model.model import load

    try:
        return not load(path).provenance.get("interrupted")
    except UserError:
        return False


DEMO = Verb(
    "demo",
    "open Spot, or write its picture, shader and web page; --train: the built-in shape instead",
    demo_arguments,
    run_demo,
)


def verbs() -> dict[str, Verb]:
    """Name -> verb, in the order of the help. Imports each room's cli.py, and these import little."""
    found = [DEMO, *(verb for room in ROOMS for verb in importlib.import_module(f".{room}.cli", __package__).VERBS)]
    return {verb.name: verb for verb in found}


def perform(argv: Sequence[str]) -> None:
    """Runs the verb that `argv` names. Raises UserError; SystemExit(0) after --help."""
    known = verbs()
    parser = Parser(prog="mplicits", usage="mplicits VERB ...", description=ABOUT, epilog=EXAMPLE)
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    choices = parser.add_subparsers(title="verbs", metavar="VERB", dest="verb", prog="mplicits")
    for verb in known.values():
        verb.arguments(choices.add_parser(verb.name, help=verb.help, description=verb.help))
    if argv and not argv[0].startswith("-") and argv[0] not in known:
        near = get_close_matches(argv[0], known, n=1)
        raise UserError(f"no verb {argv[0]!r}; " + (f"did you mean '{near[0]}'?" if near else "see mplicits --help"))
    args = parser.parse_args(argv)
    if args.version:
        print(f"mplicits {version()}")
    elif args.verb is None:
        parser.print_help()
    else:
        known[args.verb].run(args)


def version() -> str:
    """The installed version."""
    from importlib import metadata

    try:
        return metadata.version("mplicits")
    except metadata.PackageNotFoundError:
        return "(not installed)"


def missing(error: ModuleNotFoundError, verb: str) -> str | None:
    """The line for a package that `verb` needs and is not installed; None where the module is no other project's."""
    module = (error.name or "").partition(".")[0]
    if not module or module in {*sys.stdlib_module_names, "mplicits"} or find_spec(module):
        return None
    extra = "mesh" if verb in MESHING else "train"
    if module in EXTRAS[extra]:
        return f"{extra}ing needs the package '{module}'; run: pip install 'mplicits[{extra}]'"
    return f"the package '{module}' is missing; run: pip install {PACKAGES.get(module, module)}"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command line (sys.argv's by default) and returns the exit code: 2 for what the user can mend."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A file name need not be text that the terminal can show.
            stream.reconfigure(errors="backslashreplace")
    argv = sys.argv[1:] if argv is None else argv
    try:
        perform(argv)
        sys.stdout.flush()
    except UserError as error:
        return fail(str(error), 2)
    except ModuleNotFoundError as error:
        line = missing(error, argv[0])
        if line is None:
            raise
        return fail(line, 2)
    except KeyboardInterrupt:
        return fail("interrupted", 130)
    except BrokenPipeError:
        # The reader left. What is still buffered has nowhere to go, and must not complain at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except SystemExit as done:  # argparse, after --help
        return done.code if isinstance(done.code, int) else 0
    return 0


def fail(line: str, code: int) -> int:
    """Prints the one line and returns `code`."""
    print(f"mplicits: {show(line)}", file=sys.stderr)
    return code
