"""The verb `compose`."""

import sys
from dataclasses import dataclass
from pathlib import Path

from ..model.gallery import SUFFIX
from ..model.options import Options, argument
from ..model.references import follow_option
from ..model.verb import Verb, force_option, output_option


@dataclass(frozen=True)
class ComposeCommand(Options):
    """Command line of `compose`."""

    scene: Path = argument("SCENE", "scene (.toml): models, their placements, and the operations that join them")
    output: Path | None = output_option("M", "model file (default: SCENE's name, .safetensors)")
    follow: bool = follow_option()
    force: bool = force_option()


def _compose(command: ComposeCommand) -> None:
    """Write a scene as a model file. Raises UserError."""
    from ..model.files import check_writable, show
    from ..model.kinds import MODEL
    from ..model.model_file import save
    from ..model.scene import shapes_of
    from .compose import composed
    from .scene_file import read_scene

    output = command.output or Path(command.scene.stem + SUFFIX)
    scene = read_scene(command.scene, command.follow)
    check_writable(output, scene.files, kind=MODEL, force=command.force)
    model = composed(scene)
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
        ComposeCommand,
        "compose scene.toml -o scene.safetensors",
        _compose,
    ),
)
