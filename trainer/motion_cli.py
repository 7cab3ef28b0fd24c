"""The verb `morph` of the command line."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.errors import UserError
from ..model.gallery import model_path
from ..model.verb import Verb
from .cli import before_torch, settings_of, train, training_arguments

if TYPE_CHECKING:
    from ..model.model import Model
    from .motion import ModelSurface


def arguments(parser: ArgumentParser) -> None:
    """Add the options of `morph`."""
    what = "a mesh (PLY OBJ STL GLB), a model (.safetensors), a name of the gallery, or the word `demo`"
    parser.add_argument("first", metavar="A", help=f"the shape at t = 0: {what}")
    parser.add_argument("second", metavar="B", help="the shape at t = 1, likewise")
    parser.add_argument(
        "--in-place",
        action="store_true",
        help="leave both where they are, in the one space that they share (default: each fits the unit sphere)",
    )
    training_arguments(parser)


def morph_verb(
    describe_surface: "Callable[[Model, bool], str]", surface_of: "Callable[[Model, bool], ModelSurface]"
) -> Verb:
    """Make the verb `morph`.

    describe_surface: describes the surface of the trained model in a line for people. surface_of: extracts the surface
    of a model that is A or B. Both are told whether to be quiet.
    """
    return Verb(
        "morph",
        "one shape becomes another while time goes by",
        arguments,
        "morph spot bob -o spot-to-bob.safetensors",
        lambda options: run(options, describe_surface, surface_of),
    )


def run(
    options: Namespace,
    describe_surface: "Callable[[Model, bool], str]",
    surface_of: "Callable[[Model, bool], ModelSurface]",
) -> None:
    """Train the motion from A to B, save the model, and print its figures. Raises UserError."""
    if options.texture not in ("auto", "none"):
        raise UserError(f"--texture {options.texture}: auto or none is needed; two shapes have no image in common")
    settings = settings_of(options)
    before_torch()
    from ..model.mesh_file import SUFFIXES, mesh_files
    from .motion import morph_loader

    reads = []
    for key in ("first", "second"):
        name = getattr(options, key)
        if name != "demo" and Path(name).suffix.lower() not in SUFFIXES:
            setattr(options, key, str(model_path(name)))
        reads += mesh_files(Path(getattr(options, key)))
    name = "-to-".join(Path(text).stem for text in (options.first, options.second))
    load = morph_loader(options, lambda model: surface_of(model, options.quiet))
    train(options, settings, describe_surface, name, reads, load)
