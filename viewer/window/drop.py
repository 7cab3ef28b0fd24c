"""What becomes of files that the user lets fall on the window."""

from pathlib import Path

from ...model.files import show
from ..state.desk import Desk
from ..state.source import CHECKPOINTS, MESHES, SHADERS


def drop(desk: Desk, paths: list[Path]) -> None:
    """The first one counts, and checkpoints with it: a model or shader is shown, a shape trained, networks imported."""
    if not paths:
        return
    path = paths[0]
    suffix = path.suffix.lower()
    if suffix in MESHES:
        desk.train([path])
    elif suffix in CHECKPOINTS:
        desk.train([path for path in paths if path.suffix.lower() in CHECKPOINTS])
    elif suffix in (".safetensors", *SHADERS):
        desk.stop_training()
        desk.open(path)
    else:
        desk.say(
            f"{show(path.name)}: neither a model (.safetensors), a shader (.glsl), a checkpoint (.pth) "
            f"nor a mesh ({' '.join(MESHES)})"
        )
