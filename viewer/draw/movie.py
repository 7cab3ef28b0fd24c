"""Videos: what each picture of one shows, and their files, MP4 by PyAV or GIF by Pillow, made in memory."""

import io
import itertools
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...codegen.targets.motion import time_at_phase
from ...model.errors import UserError
from ...model.files import show
from .camera import Camera
from .options import RenderOptions
from .screenshot import to_bytes

SUFFIXES = (".mp4", ".gif")
"""Endings of videos."""
MOST_FRAMES = 10_000
"""Most pictures of a video."""
RATES = 1, 60
"""Fewest and most pictures a second."""
SEEN_FRAMES = 24
"""A GIF's colours are chosen from so many of its pictures."""


@dataclass(frozen=True)
class Shot:
    """What a video shows: a model's motion, a turn of the camera, or both."""

    frames: int
    """Number of pictures."""
    rate: int = 30
    """Pictures a second."""
    turn: float = 0.0
    """Degrees by which the camera turns around its target, from the first picture to the one after the last."""
    moves: bool = False
    """Whether the model's time goes from 0 to 1 and back; the picture after the last would be the first again."""
    once: bool = False
    """Whether it goes from 0 to 1 evenly instead, and ends there."""

    def frame(self, k: int, camera: Camera, options: RenderOptions) -> tuple[Camera, RenderOptions]:
        """Return where picture k, from 0, is seen from, and what it shows. camera, options: of the first."""
        phase = k / self.frames
        camera = camera.orbited(self.turn * phase, 0.0)
        if not self.moves:
            return camera, options
        return camera, replace(options, time=k / max(1, self.frames - 1) if self.once else time_at_phase(phase))


class Movie(Protocol):
    """A video that grows picture by picture."""

    def add(self, image: NDArray[np.float32]) -> None:
        """Append a picture (H, W, 3 or more) float32, sRGB in [0, 1], top row first."""

    def data(self) -> bytes:
        """Return the file; no picture may follow."""

    def close(self) -> None:
        """Free what is held, also where the file was never asked for."""


def check_movie(path: Path, size: tuple[int, int]) -> None:
    """Raise UserError where a path does not end as a video does, or the video cannot have so many pixels."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise UserError(f"{show(path)}: videos are MP4 or GIF; name it .mp4 or .gif")
    if suffix == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise UserError(f"size {size[0]}x{size[1]}: the sides of an MP4 are even numbers; a GIF may have any")


@contextmanager
def open_movie(path: Path, size: tuple[int, int], rate: int) -> Iterator[Movie]:
    """Begin a video of the kind that a path's name tells; its file is the caller's to write.

    size: (width, height) in pixels. rate: pictures a second. Raises what `check_movie` raises, and UserError where the
    package that encodes MP4 is missing or has no H.264.
    """
    check_movie(path, size)
    movie: Movie = Gif(rate) if path.suffix.lower() == ".gif" else Mp4(size, rate)
    try:
        yield movie
    except ValueError as error:  # PyAV has no such encoder
        raise UserError(f"cannot encode {show(path)}: {error}") from None
    finally:
        movie.close()


class Mp4:
    """An MP4 file, H.264."""

    def __init__(self, size: tuple[int, int], rate: int) -> None:
        try:
            import av
        except ImportError:
            raise UserError(
                "videos need the package 'av'; run: pip install 'mplicits[view]', or name it .gif"
            ) from None
        self._frame_of = av.VideoFrame.from_ndarray
        self._file = io.BytesIO()
        self._container = av.open(self._file, "w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=Fraction(rate), options={"crf": "18"})
        self._stream.width, self._stream.height, self._stream.pix_fmt = *size, "yuv420p"

    def add(self, image: NDArray[np.float32]) -> None:
        """Append a picture."""
        self._container.mux(self._stream.encode(self._frame_of(to_bytes(image[..., :3]))))

    def data(self) -> bytes:
        """Return the file."""
        self._container.mux(self._stream.encode())
        self._container.close()
        return self._file.getvalue()

    def close(self) -> None:
        """Free the encoder."""
        self._container.close()


class Gif:
    """An animated GIF that repeats, with one palette for all pictures, so that what stands still does not flicker."""

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._frames: list[bytes] = []
        """The pictures' bytes, compressed: the palette is known only at the end."""
        self._shape = (0, 0, 3)

    def add(self, image: NDArray[np.float32]) -> None:
        """Append a picture."""
        pixels = to_bytes(image[..., :3], dithered=False)
        self._shape = pixels.shape
        self._frames.append(zlib.compress(pixels.tobytes(), 1))

    def data(self) -> bytes:
        """Return the file. A picture is shown for whole hundredths of a second, some for one more than others."""
        palette = self._palette()
        first, *others = (
            self._picture(k).quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
            for k in range(len(self._frames))
        )
        ends = [round(100 * k / self._rate) for k in range(len(self._frames) + 1)]
        durations = [10 * (end - start) for start, end in itertools.pairwise(ends)]
        file = io.BytesIO()
        first.save(file, "GIF", save_all=True, append_images=others, duration=durations, loop=0, optimize=False)
        return file.getvalue()

    def close(self) -> None:
        """Forget the pictures."""
        self._frames.clear()

    def _palette(self) -> Image.Image:
        """Choose 256 colours of the pictures. Each that occurs counts once: most pixels are of the background."""
        every = -(-len(self._frames) // SEEN_FRAMES)
        pixels = [np.asarray(self._picture(k))[::2, ::2].reshape(-1, 3) for k in range(0, len(self._frames), every)]
        colours = np.unique(np.concatenate(pixels) >> 2, axis=0) << 2 | 2
        return Image.fromarray(colours[None]).quantize(256, Image.Quantize.MEDIANCUT)

    def _picture(self, k: int) -> Image.Image:
        return Image.frombytes("RGB", self._shape[1::-1], zlib.decompress(self._frames[k]))
