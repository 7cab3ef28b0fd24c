"""Work that goes on while the window is used: each job is a generator that yields (share done, what it does) after a
bit of work and returns one line for the user. Raises UserError.
"""

from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...codegen.targets.registry import TARGETS
from ...model.errors import UserError
from ...model.files import show, write_whole
from ...model.model import Model, save
from ..draw.camera import Camera
from ..draw.options import RenderOptions
from ..draw.renderer import Part, Renderer, check_size, tiles
from ..draw.screenshot import to_png
from ..draw.supersampling import Image
from .picture import Scene

LONGEST = 100
"""Characters of a model's name that a file's name begins with."""
Job = Generator[tuple[float, str], None, str]
Made = TypeVar("Made")


def free_path(stem: str, suffix: str) -> Path:
    """The first of STEM.suffix, STEM-2.suffix, ... in the working folder that is not there."""
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in stem[:LONGEST]).strip("-.") or "mplicits"
    path, number = Path(stem + suffix), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}{suffix}"), number + 1
    return path


def picture(renderer: Renderer, path: Path, scene: Scene, title: str) -> Job:
    """A PNG of the scene, tile by tile: what `mplicits render` draws."""
    check_size(scene.size)
    width, height = scene.size
    image = np.empty((height, width, 4), np.float32)
    parts = list(_parts(scene))
    for k, part in enumerate(parts):
        yield k / len(parts), f"drawing {width}x{height}"
        _draw(renderer, scene, part, image)
    write_whole(path, (yield from _aside(lambda: to_png(image[::-1], title), (1.0, "writing PNG"))))
    return f"saved {show(path)}"


def _parts(scene: Scene) -> Iterator[tuple[Part, RenderOptions]]:
    for left, right, options in scene.panes(scene.size[0]):
        for x, y, width, height in tiles((right - left, scene.size[1])):
            yield (left + x, y, width, height), options


def _draw(renderer: Renderer, scene: Scene, part: tuple[Part, RenderOptions], image: Image) -> None:
    """Into its place of `image`, bottom row first."""
    (x, y, width, height), options = part
    image[y : y + height, x : x + width] = renderer.tile(part[0], scene.size, scene.camera, options)


def target(name: str, model: Model, path: Path) -> Job:
    """What `mplicits bake --target name` writes; "model": the model file."""
    if name == "model":
        save(model, path)
    else:
        write_whole(path, (yield from _aside(lambda: TARGETS[name](model), (0.0, f"writing {name}"))))
    return f"saved {show(path)}"


def _aside(work: Callable[[], Made], doing: tuple[float, str]) -> Generator[tuple[float, str], None, Made]:
    """What `work` makes, in a thread, so that the window goes on. Who closes this does not wait for it."""
    pool = ThreadPoolExecutor(1)
    try:
        made = pool.submit(work)
        while not made.done():
            yield doing
        return made.result()
    finally:
        pool.shutdown(wait=False)


@dataclass(frozen=True)
class Turntable:
    """A video of one turn around the target. size: even numbers of pixels."""

    size: tuple[int, int] = (640, 480)
    seconds: float = 6.0
    rate: int = 30

    def job(self, renderer: Renderer, path: Path, scene: Scene) -> Job:
        """Writes an MP4 (H.264) of the scene frame by frame, at the video's own size."""
        try:
            import av
        except ImportError:
            raise UserError("videos need the package 'av'; run: pip install 'mplicits[view]'") from None
        check_size(self.size)
        width, height = self.size
        scene = replace(scene, size=self.size, camera=replace(scene.camera, aspect=width / height))
        count = max(1, round(self.seconds * self.rate))
        partial = path.with_name(f".{path.name}.part")
        try:
            with closing(av.open(str(partial), "w", format="mp4")) as container:
                stream = container.add_stream("libx264", rate=Fraction(self.rate), options={"crf": "18"})
                stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
                for k in range(count):
                    yield k / count, f"drawing {k + 1} of {count} pictures"
                    turned = replace(scene, camera=scene.camera.orbited(360.0 * k / count, 0.0))
                    image = np.empty((height, width, 4), np.float32)
                    for part in _parts(turned):
                        _draw(renderer, turned, part, image)
                    pixels = np.rint(np.clip(image[::-1, :, :3], 0, 1) * 255).astype(np.uint8)
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels))))
                container.mux(stream.encode())
            partial.replace(path)
        except (OSError, ValueError) as error:  # ValueError: PyAV has no such encoder
            raise UserError(f"cannot write {show(path)}: {getattr(error, 'strerror', None) or error}") from None
        finally:
            partial.unlink(missing_ok=True)
        return f"saved {show(path)}"


@dataclass(frozen=True)
class Cost:
    """Of tracing and shading up to one level. milliseconds: of a frame by the GPU's clock; steps: of a ray, mean;
    ended: share of the rays that ended at this level when all are traced.
    """

    milliseconds: float
    steps: float
    ended: float


def costs(
    renderer: Renderer,
    size: tuple[int, int],
    camera: Camera,
    options: RenderOptions,
    done: Callable[[list[Cost]], None],
) -> Job:
    """Measures each level at `size`; `done` is given the result. Rays that never come near the shape count as steps 0
    and as ended in no level.
    """
    levels = renderer.shader.levels
    each = [replace(options, level=level, normal_level=level, samples=1) for level in range(1, levels + 1)]
    ended = np.zeros(levels)
    found = []
    for level, chosen in enumerate(each, start=1):
        yield (level - 1) / levels, f"measuring level {level}"
        data = renderer.render(size, camera, replace(chosen, shading="data"))
        edges, renderer.edges = renderer.edges, None
        milliseconds = 1000 * renderer.timed(size, camera, chosen)[1]
        renderer.edges = edges
        if level == levels:
            ended = np.array([(data[..., 2] == k).mean() for k in range(1, levels + 1)])
        found.append((milliseconds, float(data[..., 1].mean())))
    done([Cost(*figures, float(share)) for figures, share in zip(found, ended, strict=True)])
    return f"measured at {size[0]}x{size[1]}"
