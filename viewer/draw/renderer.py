"""Draws whole pictures with a baked shader, off screen: in tiles, with supersampling."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from .adaptive import add_samples, first_offset, from_blocks, into_blocks, sample_counts, sample_points
from .camera import Camera
from .framebuffer import check_drawn, read_pixels
from .options import RenderOptions
from .sampler import Sampler
from .supersampling import Image, from_linear, jitters, to_linear
from .tiles import TILE_SIDE, Tile, check_size, largest_tile, tiles, with_border


class Renderer(Sampler):
    """Draws pictures with one shader. Raises UserError if the driver rejects the shader or the weights."""

    drawn = 0
    """Number of samples of all pictures so far."""

    def render(self, size: tuple[int, int], camera: Camera, options: RenderOptions | None = None) -> Image:
        """Draw a picture of `size` (width, height) pixels: (H, W, 4) float32, top row first.

        rgb is sRGB, the mean of a pixel's samples in linear light; alpha is the share of the samples that hit. The
        shading "data" is raw, from the pixel centers. A terminal shows a progress bar. Raises UserError if the size or
        the options do not fit, or the driver fails.
        """
        options = options or RenderOptions()
        check_size(size)
        samples = len(list(tiles(size))) * len(_sample_offsets(options))
        with tqdm(total=samples, desc="render", delay=2, leave=False, disable=None) as bar:
            return self.render_tiles(size, camera, options, bar.update)

    def render_tiles(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, after_sample: Callable[[], object]
    ) -> Image:
        """Draw the picture of `render`. after_sample: see `render_tile`."""
        image = np.empty((size[1], size[0], 4), np.float32)
        for tile in tiles(size):
            x, y, width, height = tile
            image[y : y + height, x : x + width] = self.render_tile(tile, size, camera, options, after_sample)
        return image[::-1]

    def render_tile(
        self,
        tile: Tile,
        size: tuple[int, int],
        camera: Camera,
        options: RenderOptions,
        after_sample: Callable[[], object] = lambda: None,
    ) -> Image:
        """Draw a tile, at most TILE_SIDE a side, of the picture of `render`: (H, W, 4), bottom row first.

        after_sample: called after each sample of all pixels.
        """
        adapts, transparent = self.adapts(options), options.transparent
        offsets = first_offset(options.samples) if adapts else _sample_offsets(options)
        averaged = adapts or len(offsets) > 1 or transparent
        # Adaptive sampling compares the pixels at the tile's border with their neighbors in the next tile.
        drawn = with_border(tile, size) if adapts else tile
        total = np.zeros((drawn[3], drawn[2], 4), np.float32)
        counts: NDArray[np.int64] | int = len(offsets)
        with self.context as gl:
            _ = gl.error  # clears errors of earlier calls
            target = self._target(gl, largest_tile(size))
            for x, y in offsets.tolist():
                self.prepare(size, camera, options, (x, y))
                self.draw(target, drawn)
                sample = read_pixels(target, drawn[2:])
                total += to_linear(sample, transparent) if averaged else sample
                after_sample()
            if adapts:
                x, y, width, height = tile
                inside = np.s_[y - drawn[1] : y - drawn[1] + height, x - drawn[0] : x - drawn[0] + width]
                further = sample_counts(sample, options.samples)[inside]
                points, pixels = sample_points(further, (x, y))
                total, counts = total[inside].copy(), 1 + further[..., None]
                add_samples(total, pixels, to_linear(self.samples_at(points), transparent))
                for _ in range(1, options.samples):
                    after_sample()
            check_drawn(gl, self.context.renderer)
        self.drawn += int(np.broadcast_to(counts, (*total.shape[:2], 1)).sum())
        return from_linear(total / counts, transparent) if averaged else total

    def adapts(self, options: RenderOptions) -> bool:
        """Whether a pixel's number of samples depends on its contrast with its neighbors."""
        several = options.samples > 1 and not options.uniform and options.shade != "data"
        return several and self.shader.passes is not None and self.edges is None

    def samples_at(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Draw samples, (N, 4), at points (N, 2) of the picture that `prepare` has set up.

        Points are in pixels from the picture's lower left corner. The context must be current, and `adapts` true.
        """
        gl = self.context.gl
        assert self._passes is not None
        target, drawn = self._target(gl, self._passes.places.size), []
        for start in range(0, len(points), TILE_SIDE**2):
            part = points[start : start + TILE_SIDE**2]
            packed = into_blocks(part, TILE_SIDE)
            height, width, _ = packed.shape
            self._passes.places.write(packed.tobytes(), (0, 0, width, height))
            self._passes.scattered = packed
            self.draw(target, (0, 0, width, height))
            drawn.append(from_blocks(read_pixels(target, (width, height)), len(part)))
        self._passes.scattered = None
        return np.concatenate(drawn) if drawn else np.empty((0, 4), np.float32)

    def timed(self, size: tuple[int, int], camera: Camera, options: RenderOptions) -> tuple[float, float]:
        """Draw one sample of each pixel, and return the seconds by the wall clock and by the GPU's clock."""
        check_size(size)
        gpu_seconds = 0.0
        with self.context as gl:
            query = gl.query(time=True)
            target = self._target(gl, largest_tile(size))
            gl.finish()
            start = time.perf_counter()
            self.prepare(size, camera, options)
            for tile in tiles(size):
                with query:
                    self.draw(target, tile)
                gpu_seconds += query.elapsed / 1e9
            check_drawn(gl, self.context.renderer)
            return time.perf_counter() - start, gpu_seconds


def _sample_offsets(options: RenderOptions) -> NDArray[np.float32]:
    """Return the offsets (N, 2) of a pixel's samples from its center, pixels; raw data has one, 0."""
    return jitters(1 if options.shade == "data" else options.samples)
