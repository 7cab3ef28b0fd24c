"""The file of a video: the work of `render --frames`."""

from pathlib import Path

from tqdm import tqdm

from ..model.files import write_whole
from .draw.camera import Camera
from .draw.movie import Shot, open_movie
from .draw.options import RenderOptions
from .draw.renderer import Renderer
from .draw.tiles import tiles


def write_video(
    renderer: Renderer, path: Path, size: tuple[int, int], shot: Shot, camera: Camera, options: RenderOptions
) -> float:
    """Draw a video and write its file, whole or not at all; on a terminal, a bar shows the progress of long work.

    size: (width, height) in pixels. camera, options: of the first picture. Returns the share of all samples that hit
    the shape. Raises UserError where the driver fails or the file cannot be written.
    """
    coverage, total = 0.0, shot.frames * len(list(tiles(size))) * options.samples
    with (
        open_movie(path, size, shot.rate) as movie,
        tqdm(total=total, desc="render", delay=2, leave=False, disable=None) as bar,
    ):
        for k in range(shot.frames):
            image = renderer.render_tiles(size, *shot.frame(k, camera, options), bar.update)
            movie.add(image)
            coverage += float(image[..., 3].mean()) / shot.frames
        write_whole(path, movie.data())
    return coverage
