"""Work in small bits, so that the window goes on between them: pictures, videos, exports, timings of the levels."""

from collections.abc import Callable, Generator, Iterator
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
from ..draw.tiles import Tile, check_size, tiles
from .picture import Scene

Progress = tuple[float, str]
"""The share of a job that is done, from 0 to 1, and what it does now."""
Job = Generator[Progress, None, str]
"""Yields its progress after each bit of work, returns one line for the user, and raises UserError if it fails."""
Result = TypeVar("Result")


def write_picture(renderer: Renderer, path: Path, scene: Scene, title: str) -> Job:
    """Draw the scene tile by tile, as `mplicits render` does, and write it as a PNG file with `title` in it."""
    check_size(scene.size)
    width, height = scene.size
    image = np.empty((height, width, 4), np.float32)
    scene_tiles = list(_tiles(scene))
    for k, (tile, options) in enumerate(scene_tiles):
        yield k / len(scene_tiles), f"drawing {width}x{height}"
        _draw(renderer, scene, tile, options, image)
    write_whole(path, (yield from _in_thread(lambda: to_png(image[::-1], title), (1.0, "writing PNG"))))
    return f"saved {show(path)}"


def _tiles(scene: Scene) -> Iterator[tuple[Tile, RenderOptions]]:
    """Yield the tiles that make up the scene, each with the options of the half that it lies in."""
    for left, right, options in scene.panes(scene.size[0]):
        for x, y, width, height in tiles((right - left, scene.size[1])):
            yield (left + x, y, width, height), options


def _draw(renderer: Renderer, scene: Scene, tile: Tile, options: RenderOptions, image: Image) -> None:
    """Draw a tile into its place of `image`, whose first row is the picture's bottom row."""
    x, y, width, height = tile
    image[y : y + height, x : x + width] = renderer.render_tile(tile, scene.size, scene.camera, options)


def write_target(name: str, model: Model, path: Path) -> Job:
    """Write what `mplicits bake --target name` writes, or the model file if `name` is "model"."""
    if name == "model":
        save(model, path)
    else:
        write_whole(path, (yield from _in_thread(lambda: TARGETS[name](model), (0.0, f"writing {name}"))))
    return f"saved {show(path)}"


def _in_thread(work: Callable[[], Result], progress: Progress) -> Generator[Progress, None, Result]:
    """Call `work` in a thread, yield `progress` until it is done, and return what it returns.

    Closing the generator before that leaves the thread to itself, so that a cancelled job does not block the window.
    """
    pool = ThreadPoolExecutor(1)
    try:
        future = pool.submit(work)
        while not future.done():
            yield progress
        return future.result()
    finally:
        pool.shutdown(wait=False)


@dataclass(frozen=True)
class Video:
    """A video of one turn around the camera's target or, of a model that moves, of its motion there and back."""

    size: tuple[int, int] = (640, 480)
    """(width, height) in pixels, both even, as H.264 demands."""
    seconds: float = 6.0
    """Length of the video."""
    rate: int = 30
    """Pictures per second."""

    def write(self, renderer: Renderer, path: Path, scene: Scene) -> Job:
        """Write an MP4 file (H.264) of the scene, one frame after the other, in the video's size, not the scene's."""
        check_size(self.size)
        width, height = self.size
        camera = replace(scene.camera, aspect=width / height)
        count, moves = max(1, round(self.seconds * self.rate)), renderer.shader.moving
        shot = Shot(count, self.rate, turn=0.0 if moves else 360.0, moves=moves)
        with open_movie(path, self.size, self.rate) as movie:
            for k in range(count):
                yield k / count, f"drawing {k + 1} of {count} pictures"
                frame = replace(scene.at(*shot.frame(k, camera, scene.options)), size=self.size)
                image = np.empty((height, width, 4), np.float32)
                for tile, options in _tiles(frame):
                    _draw(renderer, frame, tile, options, image)
                movie.add(image[::-1])
            write_whole(path, movie.data())
        return f"saved {show(path)}"


@dataclass(frozen=True)
class LevelTiming:
    """What tracing and shading up to one level costs."""

    milliseconds: float
    """Of a frame, by the GPU's clock."""
    steps: float
    """Sphere tracing steps of a ray on average; a ray that never comes near the shape counts as 0."""
    ended: float
    """Share of the rays that end at this level when all levels are traced; rays that pass the shape end at none."""


def time_levels(
    renderer: Renderer,
    size: tuple[int, int],
    camera: Camera,
    options: RenderOptions,
    done: Callable[[list[LevelTiming]], None],
) -> Job:
    """Draw pictures of `size` (width, height) pixels up to each level; give `done` the timings, level 1 first."""
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
