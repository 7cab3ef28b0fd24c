"""Files that the window saves into the working folder: pictures, videos, models."""

from dataclasses import replace
from pathlib import Path

from ...bake.registry import TARGETS
from .jobs import write_picture, write_target, write_video
from .picture import Scene
from .viewer import Viewer

SAVED_SAMPLES = 16
"""Least number of samples per pixel of a saved picture."""
MAX_STEM = 100
"""Largest number of characters of the model's name in a file name."""


def save_picture(viewer: Viewer, size: tuple[int, int]) -> None:
    """Start to write the picture in `size` (width, height) pixels as a PNG file."""
    view, name = viewer.view, viewer.source.name
    options = replace(view.options, samples=max(SAVED_SAMPLES, view.options.samples))
    right = None if view.right is None else replace(view.right, samples=options.samples)
    scene = Scene(size, replace(view.camera, aspect=size[0] / size[1]), options, right)
    viewer.work.begin(write_picture(viewer.current_renderer(), free_path(name, ".png"), scene, name), draws=True)


def record_video(viewer: Viewer, area: tuple[int, int]) -> None:
    """Start to write a video of one turn, or of the model's motion. area: (width, height) of the picture, pixels."""
    path = free_path(viewer.source.name, ".mp4")
    viewer.work.begin(write_video(viewer.current_renderer(), path, viewer.view.scene(area)), draws=True)


def save_target(viewer: Viewer, name: str) -> None:
    """Start to write what `mplicits bake --target name` writes, or the model file for the name "model".

    The source must be a model, not a shader file.
    """
    source = viewer.source
    assert source.model is not None
    suffix = ".safetensors" if name == "model" else TARGETS[name].suffix
    viewer.work.begin(write_target(name, source.model, free_path(source.name, suffix)))


def free_path(stem: str, suffix: str) -> Path:
    """Return the first of STEM.suffix, STEM-2.suffix, ... that does not exist in the working folder."""
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in stem[:MAX_STEM]).strip("-.") or "mplicits"
    path, number = Path(stem + suffix), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}{suffix}"), number + 1
    return path
