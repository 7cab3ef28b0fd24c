"""Frames per second of the viewer's renderer while the camera turns; writes a markdown page.

    python benchmarks/viewer_fps.py M.safetensors .. [--size 640x480] [--frames 24] [-o docs/results/viewer.md]

A frame is one ray per pixel, all levels, Phong shading, off screen: what the window draws while nothing limits its
pixels. What showing it costs (one textured triangle, the panel) is left out. `moving` is what the window does with it.
"""

import argparse
import os
import platform
import time
from datetime import UTC, datetime
from pathlib import Path

from codegen.glsl330 import bake
from codegen.model import load, shape_of
from viewer.camera import Camera
from viewer.context import Context, open_context
from viewer.options import RenderOptions
from viewer.picture import Picture, Scene
from viewer.renderer import Renderer
from viewer.view import View

HEAD = "| model | levels | parameters | compiled in | frames per second | moving: pixels | moving: frames per second |"


def processor() -> str:
    """The processor's name."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def rate(picture: Picture, renderer: Renderer, view: View, size: tuple[int, int], frames: int, adapt: bool) -> float:
    """Frames per second of a turn; `adapt`: with as many pixels as the view finds fit to move."""
    seconds = 0.0
    for k in range(-3, frames):  # The first ones warm up, and find the number of pixels.
        start = time.perf_counter()
        camera = view.home.orbited(360.0 * k / frames, 0.0)
        picture.sketch(renderer, Scene(size, camera, view.options), view.scale if adapt else 1.0)
        took = time.perf_counter() - start
        if adapt and k < 0:
            view.timed(took)
        seconds += took if k >= 0 else 0.0
    return frames / seconds


def row(context: Context, path: Path, size: tuple[int, int], frames: int) -> str:
    """One line of the table."""
    model = load(path)
    renderer, picture = Renderer(context, bake(model)), Picture(context)
    view = View(Camera(aspect=size[0] / size[1]), RenderOptions(), len(model.levels), model.texture is not None)
    full = rate(picture, renderer, view, size, frames, adapt=False)
    moving = rate(picture, renderer, view, size, frames, adapt=True)
    pixels = " x ".join(str(round(side / view.scale)) for side in size)
    picture.release()
    renderer.release()
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    return (f"| {model.name} | {levels} | {model.parameters():,} | {renderer.compile_seconds:.1f} s | {full:.2f} | "
            f"{pixels} | {moving:.1f} |")


def main() -> None:
    """Writes the page for the models named on the command line."""
    parser = argparse.ArgumentParser(description="frames per second of the viewer")
    parser.add_argument("models", type=Path, nargs="+", metavar="M.safetensors")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--frames", type=int, default=24, help="of a turn (default 24)")
    parser.add_argument("--context", default="auto")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/viewer.md"))
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    context = open_context(arguments.context)
    lines = [
        "# The viewer's frames per second", "",
        f"`python benchmarks/viewer_fps.py`, {width}x{height}, {arguments.frames} frames of a turn; {context.kind} on "
        f"{context.renderer}; {processor()}, {os.cpu_count()} cores; {datetime.now(UTC):%Y-%m-%d}; "
        f"load before the run {os.getloadavg()[0]:.1f}.", "",
        "One ray per pixel, all levels, Phong shading, no showing. `moving`: with the pixels that the window takes "
        "while the camera moves, to stay above 12 frames per second.", "", HEAD, "|---|---|---:|---:|---:|---:|---:|",
    ]
    for path in arguments.models:
        lines.append(row(context, path, (width, height), arguments.frames))
        print(lines[-1], flush=True)
        arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    context.release()


if __name__ == "__main__":
    main()
