"""Measures the frames per second of the viewer while the camera turns: writes docs/results/viewer.md.

    python benchmarks/viewer_fps.py spot-small spot spot-large [--size 640x480] [--frames 24] [-o FILE]

A frame has one ray per pixel, all levels, Phong shading, drawn off screen. The columns "moving" limit the pixels as the
window does while the camera moves.
"""

import argparse
import os
import time
from pathlib import Path

from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.gallery import model_path
from mplicits.model.model import shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context, open_context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.state.picture import Picture, Scene
from mplicits.viewer.state.view import View
from protocol import Page, machine

HEAD = "| model | levels | parameters | compiled in | frames per second | moving: pixels | moving: frames per second |"


def rate(picture: Picture, renderer: Renderer, view: View, size: tuple[int, int], frames: int, adapt: bool) -> float:
    """Measure the frames per second of a turn.

    size: (width, height) in pixels; adapt: limit the pixels as the window does while the camera moves.
    """
    seconds = 0.0
    for k in range(-3, frames):  # the first ones warm up, and settle the number of pixels
        start = time.perf_counter()
        camera = view.home.orbited(360.0 * k / frames, 0.0)
        picture.sketch(renderer, Scene(size, camera, view.options), view.scale if adapt else 1.0)
        frame_seconds = time.perf_counter() - start
        if adapt and k < 0:
            view.timed(frame_seconds)
        seconds += frame_seconds if k >= 0 else 0.0
    return frames / seconds


def row(context: Context, path: Path, size: tuple[int, int], frames: int) -> str:
    """Measure a model, and return its line of the table."""
    model = load(path)
    renderer, picture = Renderer(context, bake(model, passes=True)), Picture(context)
    view = View(Camera(aspect=size[0] / size[1]), RenderOptions(), len(model.levels), model.texture is not None)
    full = rate(picture, renderer, view, size, frames, adapt=False)
    moving = rate(picture, renderer, view, size, frames, adapt=True)
    pixels = " x ".join(str(round(side / view.scale)) for side in size)
    picture.release()
    renderer.release()
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    return (
        f"| {path.stem} | {levels} | {model.parameters():,} | {renderer.compile_seconds:.1f} s | {full:.2f} | "
        f"{pixels} | {moving:.1f} |"
    )


def main() -> None:
    """Write the page for the models that the command line names."""
    parser = argparse.ArgumentParser(description="frames per second of the viewer")
    parser.add_argument("models", type=model_path, nargs="+", metavar="M")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--frames", type=int, default=24, help="of a turn (default 24)")
    parser.add_argument("--context", default="auto")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/viewer.md"))
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    context = open_context(arguments.context)
    names = " ".join(path.stem for path in arguments.models)
    page = Page(
        arguments.output,
        "# The viewer's frames per second",
        "",
        f"Printed by `python benchmarks/viewer_fps.py {names} --size {arguments.size} --frames {arguments.frames}`.",
        "",
        f"{machine()}; {context.kind} on {context.renderer}; load average at the start {os.getloadavg()[0]:.1f}. "
        f"{width} x {height}, {arguments.frames} frames of a turn, one ray per pixel, all levels, Phong shading. "
        "Moving: with the pixels that the window takes while the camera moves, to stay above 12 frames per second.",
        "",
        HEAD,
        "| --- | --- |" + " ---: |" * 5,
    )
    for path in arguments.models:
        page.add(row(context, path, (width, height), arguments.frames))
    context.release()


if __name__ == "__main__":
    main()
