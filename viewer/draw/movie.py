"""Videos: the camera and time of each frame, and files in memory, MP4 by PyAV or GIF by Pillow."""

import io
import itertools
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...codegen.targets.motion import time_at_phase
from ...model.errors import UserError
from ...model.files import show
from ...model.kinds import MARK
from .camera import Camera
from .options import RenderOptions
from .screenshot import to_bytes

SUFFIXES = (".mp4", ".gif")
PALETTE_FRAMES = 24
"""Largest number of frames from which the palette of a GIF is computed."""


@dataclass(frozen=True)
class Shot:
    """The content of a video: a model's motion, a turn of the camera, or both."""

    frames: int
    """Number of frames."""
    rate: int = 30
    """Frames per second."""
    turn: float = 0.0
    """Degrees by which the camera turns; a turn of 360 loops."""
    moves: bool = False
    """Whether the model's time goes from 0 to 1 and back, as a loop."""
    once: bool = False
    """Whether it goes evenly from 0 to 1 instead, and ends."""

    def frame(self, k: int, camera: Camera, options: RenderOptions) -> tuple[Camera, RenderOptions]:
        """Return the camera and options of frame k, from 0. camera, options: of the first frame."""
        phase = k / self.frames
        camera = camera.orbited(self.turn * phase, 0.0)
        if not self.moves:
            return camera, options
        return camera, replace(options, time=k / max(1, self.frames - 1) if self.once else time_at_phase(phase))


def check_movie(path: Path, size: tuple[int, int]) -> None:
    """Raise UserError unless the path ends in a video's suffix and the format supports the size."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise UserError(f"{show(path)}: videos are MP4 or GIF; name it .mp4 or .gif")
    if suffix == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise UserError(f"size {size[0]}x{size[1]}: the sides of an MP4 are even numbers; a GIF may have any")


@contextmanager
def open_movie(path: Path, size: tuple[int, int], rate: int) -> Iterator["Mp4 | Gif"]:
    """Encode a video of the format that the path's suffix names; the caller writes the file.

    size: (width, height) in pixels. rate: frames per second. Raises UserError as `check_movie` does, and if PyAV is
    missing or has no H.264.
    """
    check_movie(path, size)
    movie = Gif(rate) if path.suffix.lower() == ".gif" else Mp4(size, rate)
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
        self._container.metadata["comment"] = MARK
        self._stream = self._container.add_stream("libx264", rate=Fraction(rate), options={"crf": "18"})
        self._stream.width, self._stream.height, self._stream.pix_fmt = *size, "yuv420p"

    def add(self, image: NDArray[np.float32]) -> None:
        """Append a frame (H, W, 3 or more), sRGB in [0, 1], top row first."""
        self._container.mux(self._stream.encode(self._frame_of(to_bytes(image[..., :3]))))

    def data(self) -> bytes:
        """Return the file; no frame may follow."""
        self._container.mux(self._stream.encode())
        self._container.close()
        return self._file.getvalue()

    def close(self) -> None:
        self._container.close()


class Gif:
    """An animated GIF that loops. All frames share a palette, so that still parts do not flicker."""

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._frames: list[bytes] = []
        """The frames' pixels, compressed: the palette is known only at the end."""
        self._shape = (0, 0, 3)

    def add(self, image: NDArray[np.float32]) -> None:
        """Append a frame (H, W, 3 or more), sRGB in [0, 1], top row first."""
        pixels = to_bytes(image[..., :3], dithered=False)
        self._shape = pixels.shape
        self._frames.append(zlib.compress(pixels.tobytes(), 1))

    def data(self) -> bytes:
        """Return the file. GIF counts hundredths of a second, so some frames last one longer than others."""
        palette = self._palette()
        first, *others = (
            self._picture(k).quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
            for k in range(len(self._frames))
        )
        ends = [round(100 * k / self._rate) for k in range(len(self._frames) + 1)]
        durations = [10 * (end - start) for start, end in itertools.pairwise(ends)]
        file = io.BytesIO()
        more = {"append_images": others, "duration": durations, "loop": 0, "comment": MARK}
        first.save(file, "GIF", save_all=True, optimize=False, **more)
        return file.getvalue()

    def close(self) -> None:
        self._frames.clear()

    def _palette(self) -> Image.Image:
        """Choose 256 colors. Each color counts once, because most pixels are background."""
        every = -(-len(self._frames) // PALETTE_FRAMES)
        pixels = [np.asarray(self._picture(k))[::2, ::2].reshape(-1, 3) for k in range(0, len(self._frames), every)]
        colors = np.unique(np.concatenate(pixels) >> 2, axis=0) << 2 | 2
        return Image.fromarray(colors[None]).quantize(256, Image.Quantize.MEDIANCUT)

    def _picture(self, k: int) -> Image.Image:
        return Image.frombytes("RGB", self._shape[1::-1], zlib.decompress(self._frames[k]))
