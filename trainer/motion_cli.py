"""The verb `morph` of the command line."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.verb import Verb
from .arguments import training_arguments
from .cli import before_torch, settings_of, train
from .options import check_no_image

if TYPE_CHECKING:
    from ..model.model import Model
    from .cli import MakesPictures
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
    describe_surface: "Callable[[Model, bool], str]",
    surface_of: "Callable[[Model, bool], ModelSurface]",
    pictures: "MakesPictures",
) -> Verb:
    """Make the verb `morph`.

    describe_surface: describes the surface of the trained model in a line for people. surface_of: extracts the surface
    of a model that is A or B. Both are told whether to be quiet. pictures: makes, for a folder, what draws a model into
    it.
    """
    return Verb(
        "morph",
        "one shape becomes another while time goes by",
        arguments,
        "morph spot bob -o spot-to-bob.safetensors",
        lambda options: run(options, describe_surface, surface_of, pictures),
    )


def run(
    options: Namespace,
    describe_surface: "Callable[[Model, bool], str]",
    surface_of: "Callable[[Model, bool], ModelSurface]",
    pictures: "MakesPictures",
) -> None:
    """Train the motion from A to B, save the model, and print its figures. Raises UserError."""
    check_no_image(options.texture)
    settings = settings_of(options)
    before_torch()
    from ..model.mesh_file import mesh_files
    from .motion import end_called, morph_loader

    ends = [end_called(name) for name in (options.first, options.second)]
    load = morph_loader(
        ends,
        lambda model: surface_of(model, options.quiet),
        in_place=options.in_place,
        up=options.up,
        crease=None if options.flat else options.crease,
    )
    reads = [path for end in ends for path in mesh_files(Path(end))]
    train(options, settings, describe_surface, pictures, "-to-".join(Path(end).stem for end in ends), reads, load)
