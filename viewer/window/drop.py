"""What becomes of files that the user drops on the window."""

from pathlib import Path

from ...model.files import show
from ..state.desk import Desk
from ..state.source import CHECKPOINT_SUFFIXES, SHADER_SUFFIXES, TRAINED_SUFFIXES


def drop(desk: Desk, paths: list[Path]) -> None:
    """Show a model or shader, train on a shape, or import checkpoints.

    The first file decides which; the others count only if they and it are checkpoints.
    """
    if not paths:
        return
    path = paths[0]
    suffix = path.suffix.lower()
    if suffix in TRAINED_SUFFIXES:
        desk.work.train([path])
    elif suffix in CHECKPOINT_SUFFIXES:
        desk.work.train([path for path in paths if path.suffix.lower() in CHECKPOINT_SUFFIXES])
    elif suffix in (".safetensors", *SHADER_SUFFIXES):
        desk.work.stop_training()
        desk.open(path)
    else:
        desk.say(
            f"{show(path.name)}: neither a model (.safetensors), a shader (.glsl), a checkpoint (.pth) "
            f"nor a mesh ({' '.join(TRAINED_SUFFIXES)})"
        )
