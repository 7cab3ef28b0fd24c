"""Files that the user drops on the window."""

from pathlib import Path

from ...model.files import show
from ..state.source import CHECKPOINT_SUFFIXES, SHADER_SUFFIXES, TRAINED_SUFFIXES
from ..state.viewer import Viewer


def drop(viewer: Viewer, paths: list[Path]) -> None:
    """Show a model or shader, train on a shape, or import checkpoints, by the suffix of the first file.

    Only checkpoints are taken together.
    """
    if not paths:
        return
    path = paths[0]
    suffix = path.suffix.lower()
    if suffix in TRAINED_SUFFIXES:
        viewer.work.train([path])
    elif suffix in CHECKPOINT_SUFFIXES:
        viewer.work.train([path for path in paths if path.suffix.lower() in CHECKPOINT_SUFFIXES])
    elif suffix in (".safetensors", *SHADER_SUFFIXES):
        viewer.work.stop_training()
        viewer.open(path)
    else:
        viewer.say(
            f"{show(path.name)}: neither a model (.safetensors), a shader (.glsl), a checkpoint (.pth) "
            f"nor a mesh ({' '.join(TRAINED_SUFFIXES)})"
        )
