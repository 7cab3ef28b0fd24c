"""Jobs in small steps, between which the window goes on: pictures, videos, exports, timings of the levels."""

from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...bake.registry import TARGETS
from ...model.files import show, write_whole
from ...model.model import Model
from ...model.model_file import save
from ..draw.camera import Camera
from ..draw.movie import Shot, open_movie
from ..draw.options import RenderOptions
from ..draw.renderer import Renderer
from ..draw.screenshot import to_png
from ..draw.supersampling import Image
from ..draw.tiles import check_size, tiles
from .picture import Scene

Progress = tuple[float, str]
"""The completed share of a job, from 0 to 1, and its current activity."""
Job = Generator[Progress, None, str]
"""Yields its progress after each step, returns a line for the user, and raises UserError if it fails."""
Result = TypeVar("Result")


def write_picture(renderer: Renderer, path: Path, scene: Scene, title: str) -> Job:
    """Draw the scene tile by tile, as `mplicits render` does, and write a PNG file with this title."""
    width, height = scene.size
    image = yield from _drawn(renderer, scene, f"drawing {width}x{height}")
    write_whole(path, (yield from _in_thread(lambda: to_png(image, title), (1.0, "writing PNG"))))
    return f"saved {show(path)}"


def _drawn(
    renderer: Renderer, scene: Scene, activity: str, start: float = 0.0, share: float = 1.0
) -> Generator[Progress, None, Image]:
    """Draw the scene: (H, W, 4), top row first. start, share: of the whole job, for its progress."""
    check_size(scene.size)
    width, height = scene.size
    image = np.empty((height, width, 4), np.float32)
    parts = [
        ((left + x, y, columns, rows), options)
        for left, right, options in scene.panes(width)
        for x, y, columns, rows in tiles((right - left, height))
    ]
    for k, (tile, options) in enumerate(parts):
        yield start + share * k / len(parts), activity
        x, y, columns, rows = tile
        image[y : y + rows, x : x + columns] = renderer.render_tile(tile, scene.size, scene.camera, options)
    return image[::-1]


def write_target(name: str, model: Model, path: Path) -> Job:
    """Write what `mplicits bake --target name` writes, or the model file for the name "model"."""
    if name == "model":
        save(model, path)
    else:
        text = yield from _in_thread(lambda: TARGETS[name](model), (0.0, f"writing {name}"))
        for file, content in {path: text, **TARGETS[name].beside(path)}.items():
            write_whole(file, content)
    return f"saved {show(path)}"


def _in_thread(work: Callable[[], Result], progress: Progress) -> Generator[Progress, None, Result]:
    """Call `work` in a thread, yield `progress` until it is done, and return its result.

    Closing the generator abandons the thread, so that canceling a job does not block the window.
    """
    pool = ThreadPoolExecutor(1)
    try:
        future = pool.submit(work)
        while not future.done():
            yield progress
        return future.result()
    finally:
        pool.shutdown(wait=False)


def write_video(
    renderer: Renderer,
    path: Path,
    scene: Scene,
    size: tuple[int, int] = (640, 480),
    seconds: float = 6.0,
    rate: int = 30,
) -> Job:
    """Write an MP4 file of one turn of the camera or, for a model that moves, of its motion there and back.

    size: (width, height) in pixels; H.264 needs even numbers. rate: frames per second.
    """
    camera = replace(scene.camera, aspect=size[0] / size[1])
    count, moves = max(1, round(seconds * rate)), renderer.shader.moving
    shot = Shot(count, rate, turn=0.0 if moves else 360.0, moves=moves)
    with open_movie(path, size, rate) as movie:
        for k in range(count):
            frame = replace(scene.at(*shot.frame(k, camera, scene.options)), size=size)
            activity = f"drawing {k + 1} of {count} pictures"
            movie.add((yield from _drawn(renderer, frame, activity, k / count, 1 / count)))
        write_whole(path, movie.data())
    return f"saved {show(path)}"


@dataclass(frozen=True)
class LevelTiming:
    """The cost of tracing and shading up to one level."""

    milliseconds: float
    """Of a frame, by the GPU's clock."""
    steps: float
    """Mean number of sphere tracing steps per ray; 0 for rays that never come near the shape."""
    ended: float
    """Share of rays that end at this level when all levels are traced; rays that miss the shape end at none."""


def time_levels(
    renderer: Renderer,
    size: tuple[int, int],
    camera: Camera,
    options: RenderOptions,
    done: Callable[[list[LevelTiming]], None],
) -> Job:
    """Draw pictures of `size` (width, height) pixels up to each level; pass the timings, level 1 first, to `done`."""
    levels = renderer.shader.levels
    ended = np.zeros(levels)
    measured = []
    for level in range(1, levels + 1):
        up_to_level = replace(options, level=level, normal_level=level, samples=1)
        yield (level - 1) / levels, f"measuring level {level}"
        data = renderer.render(size, camera, replace(up_to_level, shade="data"))
        edges, renderer.edges = renderer.edges, None
        milliseconds = 1000 * renderer.timed(size, camera, up_to_level)[1]
        renderer.edges = edges
        if level == levels:
            ended = np.array([(data[..., 2] == k).mean() for k in range(1, levels + 1)])
        measured.append((milliseconds, float(data[..., 1].mean())))
    done([LevelTiming(*figures, float(share)) for figures, share in zip(measured, ended, strict=True)])
    return f"measured at {size[0]}x{size[1]}"
