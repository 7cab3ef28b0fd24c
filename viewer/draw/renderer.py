"""Draws pictures with a baked shader off screen: tile by tile, with supersampling."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from .adaptive import add_samples, from_blocks, into_blocks, places_of, wanted
from .camera import Camera
from .framebuffer import check_drawn, read_pixels
from .options import RenderOptions
from .sampler import Sampler
from .supersampling import Image, from_linear, jitters, to_linear
from .tiles import TILE_SIDE, Tile, check_size, largest_tile, tiles, with_border


class Renderer(Sampler):
    """Draws pictures with one shader. Raises UserError where the driver refuses the shader or the weights."""

    def render(self, size: tuple[int, int], camera: Camera, options: RenderOptions | None = None) -> Image:
        """Draw a picture of `size` (width, height) pixels and return it: (H, W, 4) float32, top row first.

        rgb is sRGB, averaged over a pixel's samples in linear light; alpha is the share of the samples that hit. The
        shading "data" is raw, from the pixels' centres. On a terminal, a progress bar shows where it takes long.
        Raises UserError where the size or the options do not fit, or the driver fails.
        """
        options = options or RenderOptions()
        check_size(size)
        samples = len(list(tiles(size))) * len(_sample_offsets(options))
        with tqdm(total=samples, desc="render", delay=2, leave=False, disable=None) as bar:
            return self.render_tiles(size, camera, options, bar.update)

    def render_tiles(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, after_sample: Callable[[], object]
    ) -> Image:
        """Draw the picture that `render` gives; after_sample: as of `render_tile`."""
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
        """Draw a tile, at most TILE_SIDE a side, of the picture that `render` gives, and return it, bottom row first.

        after_sample: called each time that one sample of every pixel is drawn.
        """
        offsets = _sample_offsets(options)
        if self.adapts(options):
            return self._adaptive_tile(tile, size, camera, options, after_sample)
        averaged = len(offsets) > 1 or options.transparent
        total: Image | None = None
        with self.context as gl:
            _ = gl.error  # forgets the errors that others left
            target = self._target(gl, largest_tile(size))
            for x, y in offsets.tolist():
                self.prepare(size, camera, options, (x, y))
                self.draw(target, tile)
                sample = read_pixels(target, tile[2:])
                if averaged:
                    sample = to_linear(sample, options.transparent)
                total = sample if total is None else total + sample
                after_sample()
            check_drawn(gl, self.context.renderer)
        assert total is not None
        return from_linear(total / len(offsets), options.transparent) if averaged else total

    def adapts(self, options: RenderOptions) -> bool:
        """Whether the samples of a pixel follow its difference from its neighbours."""
        several = options.samples > 1 and not options.uniform and options.shade != "data"
        return several and self.shader.passes is not None and self.edges is None

    def samples_at(self, places: NDArray[np.float32]) -> NDArray[np.float32]:
        """Draw samples at any points (N, 2) of the picture that `prepare` was told of; return them, (N, 4).

        The points are in pixels, its lower left corner being (0, 0). The context must be current, and `adapts` true.
        """
        gl = self.context.gl
        assert self._passes is not None
        target, drawn = self._target(gl, self._passes.places.size), []
        for start in range(0, len(places), TILE_SIDE**2):
            part = places[start : start + TILE_SIDE**2]
            laid_out = into_blocks(part, TILE_SIDE)
            height, width, _ = laid_out.shape
            self._passes.places.write(laid_out.tobytes(), (0, 0, width, height))
            self._scattered = laid_out
            self.draw(target, (0, 0, width, height))
            drawn.append(from_blocks(read_pixels(target, (width, height)), len(part)))
        self._scattered = None
        return np.concatenate(drawn) if drawn else np.empty((0, 4), np.float32)

    def timed(self, size: tuple[int, int], camera: Camera, options: RenderOptions) -> tuple[float, float]:
        """Draw one sample of a picture that stays with the driver.

        Returns the seconds that it took: by the clock on the wall, and by the GPU's own.
        """
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

    def _adaptive_tile(
        self,
        tile: Tile,
        size: tuple[int, int],
        camera: Camera,
        options: RenderOptions,
        after_sample: Callable[[], object],
    ) -> Image:
        """Draw a tile as `render_tile` does, with the samples that each pixel wants."""
        # Whether a pixel wants more samples is seen by its neighbours, which may be in the next tile.
        drawn = with_border(tile, size)
        x, y, width, height = tile
        inside = np.s_[y - drawn[1] :, x - drawn[0] :]
        with self.context as gl:
            _ = gl.error  # forgets the errors that others left
            target = self._target(gl, largest_tile(size))
            self.prepare(size, camera, options)
            self.draw(target, drawn)
            sample = read_pixels(target, drawn[2:])
            after_sample()
            counts = wanted(sample, options.samples)[inside][:height, :width]
            total = to_linear(sample[inside][:height, :width], options.transparent)
            places, pixels = places_of(counts, (x, y))
            add_samples(total, pixels, to_linear(self.samples_at(places), options.transparent))
            check_drawn(gl, self.context.renderer)
        for _ in range(1, options.samples):
            after_sample()
        return from_linear(total / (1 + counts[..., None]), options.transparent)


def _sample_offsets(options: RenderOptions) -> NDArray[np.float32]:
    """Return the offsets (N, 2) of a pixel's samples from its centre, in pixels; data has one, at the centre."""
    return jitters(1 if options.shade == "data" else options.samples)
