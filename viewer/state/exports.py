"""What the user takes away from the window: pictures, videos and files of the model, in the working folder."""

from dataclasses import replace
from pathlib import Path

from ...bake.registry import TARGETS
from .desk import Desk
from .jobs import Video, write_picture, write_target
from .picture import Scene

SAVED_SAMPLES = 16
"""Most rays per pixel of a saved picture, at least."""
MAX_STEM = 100
"""Characters of a model's name, at most, that a file's name begins with."""


def save_picture(desk: Desk, size: tuple[int, int]) -> None:
    """Begin to write the picture as it is shown, in `size` (width, height) pixels, as a PNG file."""
    view, name = desk.shown.view, desk.shown.source.name
    options = replace(view.options, samples=max(SAVED_SAMPLES, view.options.samples))
    right = None if view.right is None else replace(view.right, samples=options.samples)
    scene = Scene(size, replace(view.camera, aspect=size[0] / size[1]), options, right)
    desk.work.begin(write_picture(desk.drawn_by(), free_path(name, ".png"), scene, name), draws=True)


def record_video(desk: Desk, area: tuple[int, int], video: Video) -> None:
    """Begin to write a video of one turn, or of the model's motion.

    area: (width, height) of the picture on the screen, in pixels.
    """
    scene = desk.shown.view.scene(area)
    path = free_path(desk.shown.source.name, ".mp4")
    desk.work.begin(video.write(desk.drawn_by(), path, scene), draws=True)


def save_target(desk: Desk, name: str) -> None:
    """Begin to write what `mplicits bake --target name` writes, or the model file if `name` is "model".

    What is shown must be a model, not a shader file.
    """
    source = desk.shown.source
    assert source.model is not None
    suffix = ".safetensors" if name == "model" else TARGETS[name].suffix
    desk.work.begin(write_target(name, source.model, free_path(source.name, suffix)))


def free_path(stem: str, suffix: str) -> Path:
    """Return the first of STEM.suffix, STEM-2.suffix, ... in the working folder that is not there."""
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in stem[:MAX_STEM]).strip("-.") or "mplicits"
    path, number = Path(stem + suffix), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}{suffix}"), number + 1
    return path
