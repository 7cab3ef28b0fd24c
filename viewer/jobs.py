"""Work that goes on while the window is used: each job is a generator that yields (share done, what it does) after a
bit of work and returns one line for the user. Raises UserError.
"""

from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from codegen.errors import UserError
from codegen.files import show, write_whole
from codegen.model import Model, save
from codegen.targets import TARGETS

from .camera import Camera
from .options import RenderOptions
from .renderer import Renderer, check_size, tiles
from .screenshot import save_png

Job = Generator[tuple[float, str], None, str]


def free_path(stem: str, suffix: str) -> Path:
    """The first of STEM.suffix, STEM-2.suffix, ... in the working folder that is not there."""
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in stem).strip("-.") or "mplicits"
    path, number = Path(stem + suffix), 2
    while path.exists():
        path, number = Path(f"{stem}-{number}{suffix}"), number + 1
    return path


def picture(
    renderer: Renderer, path: Path, size: tuple[int, int], camera: Camera, options: RenderOptions, title: str
) -> Job:
    """A PNG of `size`, tile by tile: what `mplicits render` draws."""
    check_size(size)
    image = np.empty((size[1], size[0], 4), np.float32)
    parts = list(tiles(size))
    for k, part in enumerate(parts):
        yield k / len(parts), f"drawing {size[0]}x{size[1]}"
        x, y, width, height = part
        image[y:y + height, x:x + width] = renderer.tile(part, size, camera, options)
    save_png(path, image[::-1], title)
    return f"saved {show(path)}"


def target(name: str, model: Model, path: Path) -> Job:
    """What `mplicits bake --target name` writes; "model": the model file."""
    with ThreadPoolExecutor(1) as pool:
        if name == "model":
            done = pool.submit(save, model, path)
        else:
            done = pool.submit(lambda: write_whole(path, TARGETS[name](model)))
        while not done.done():
            yield 0.0, f"writing {name}"
        done.result()
    return f"saved {show(path)}"


@dataclass(frozen=True)
class Turntable:
    """A video of one turn around the target. size: even numbers of pixels."""

    size: tuple[int, int] = (640, 480)
    seconds: float = 6.0
    rate: int = 30

    def job(self, renderer: Renderer, path: Path, camera: Camera, options: RenderOptions) -> Job:
        """Writes an MP4 (H.264) frame by frame."""
        try:
            import av
        except ImportError:
            raise UserError("videos need the package 'av'; run: pip install 'mplicits[view]'") from None
        size = (self.size[0] // 2 * 2, self.size[1] // 2 * 2)
        check_size(size)
        count = max(1, round(self.seconds * self.rate))
        partial = path.with_name(f".{path.name}.part")
        try:
            with closing(av.open(str(partial), "w", format="mp4")) as container:
                stream = container.add_stream("libx264", rate=Fraction(self.rate), options={"crf": "18"})
                stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
                for k in range(count):
                    yield k / count, f"drawing {k + 1} of {count} pictures"
                    image = renderer.render(size, camera.orbited(360.0 * k / count, 0.0), options)
                    pixels = np.rint(np.clip(image[..., :3], 0, 1) * 255).astype(np.uint8)
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels))))
                container.mux(stream.encode())
            partial.replace(path)
        except OSError as error:
            raise UserError(f"cannot write {show(path)}: {error.strerror or error}") from None
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
    renderer: Renderer, size: tuple[int, int], camera: Camera, options: RenderOptions,
    done: Callable[[list[Cost]], None],
) -> Job:
    """Measures each level at `size`; `done` is given the result. Rays that never come near the shape count as steps 0
    and as ended in no level.
    """
    levels = options.traced(renderer.shader.levels)[0]
    each = [replace(options, level=level, normal_level=level, samples=1) for level in range(1, levels + 1)]
    ended = np.zeros(levels)
    found = []
    for level, chosen in enumerate(each, start=1):
        yield (level - 1) / levels, f"measuring level {level}"
        data = renderer.render(size, camera, replace(chosen, shading="data"))
        milliseconds = 1000 * renderer.timed(size, camera, chosen)[1]
        if level == levels:
            ended = np.array([(data[..., 2] == k).mean() for k in range(1, levels + 1)])
        found.append((milliseconds, float(data[..., 1].mean())))
    done([Cost(*figures, float(share)) for figures, share in zip(found, ended, strict=True)])
    return f"measured at {size[0]}x{size[1]}"
