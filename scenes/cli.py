"""The verb `compose`."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..model.gallery import SUFFIX
from ..model.verb import Verb, output_arguments


def _arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `compose` to a parser."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene (.toml): models, where each is, how they join")
    output_arguments(parser, "M", "model file to write (default: SCENE's name, .safetensors)")


def _compose(arguments: Namespace) -> None:
    """Run `mplicits compose`: write a scene as a model file. Raises UserError."""
    from ..model.files import check_writable, show
    from ..model.kinds import MODEL
    from ..model.model_file import save
    from ..model.scene import shapes_of
    from .composed import compose

    output = arguments.output or Path(arguments.scene.stem + SUFFIX)
    check_writable(output, [arguments.scene], kind=MODEL, force=arguments.force)
    model = compose(arguments.scene)
    save(model, output)
    assert model.scene is not None
    shapes = sum(1 for _ in shapes_of(model.scene))
    moving = ", moving" if model.inputs == "xyzt" else ""
    print(
        f"{show(output)}: {shapes} shape{'s' * (shapes != 1)} of {len(model.shapes)} model"
        f"{'s' * (len(model.shapes) != 1)}{moving}, {model.parameters():,} parameters",
        file=sys.stderr,
    )


VERBS = (
    Verb(
        "compose",
        "place and join models as one: a scene",
        _arguments,
        "compose scene.toml -o scene.safetensors",
        _compose,
    ),
)
