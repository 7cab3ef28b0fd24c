"""Measures the frames of a model that moves beside static ones of its size: writes docs/results/motion_fps.md.

    python benchmarks/motion_fps.py spot [MOVING.safetensors ...] [--side 256] [--times 3] [--frames 4] [-o FILE]

A model that does not move is made to drift: smaller, and along a line, by its first layers' weights alone. The static
model beside a moving one is that one with a time folded into its biases: both draw the same picture with networks of
one size.
"""

import argparse
import statistics
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from moment import frozen
from mplicits.codegen.targets.glsl330 import bake
from mplicits.field.cells import MOMENTS, Cells
from mplicits.ir.lower import lower
from mplicits.model.gallery import model_path
from mplicits.model.model import Layer, Model, Network, shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from protocol import Page, machine

SIZE, WAY = 0.75, (0.4, 0.0, 0.0)
"""Of a drifting shape: how many times its own size it has, and how far it drifts from time 0 to 1, model units."""


def drifting(model: Model) -> Model:
    """Return a model that drifts along WAY, smaller, and is in the middle at time 0.5."""
    way = np.array(WAY, np.float32)

    def moved(network: Network, scale: float) -> Network:
        first, *others, last = network
        weight = first.weight / np.float32(SIZE)
        moving = np.concatenate([weight, -(weight @ way)[:, None]], axis=1)
        scaled = Layer(last.weight * np.float32(scale), last.bias * np.float32(scale))
        return (Layer(moving, first.bias + weight @ (way / np.float32(2))), *others, scaled)

    levels = tuple(
        replace(level, network=moved(level.network, SIZE), delta=level.delta * SIZE) for level in model.levels
    )
    texture = None if model.texture is None else moved(model.texture, 1.0)
    return replace(model, name=f"{model.name}, drifting", levels=levels, texture=texture, inputs="xyzt")


def measure(page: Page, model: Model, side: int, times: int, frames: int) -> None:
    """Add the row of a moving model."""
    cells = Cells(lower(model))
    began = time.process_time()
    for time_of_grid in np.linspace(0, 1, cells.moments):
        cells.grid(float(time_of_grid))
    finding = (time.process_time() - began) / cells.moments
    context = open_osmesa()
    moving = Renderer(context, bake(model, "texture", passes=True))
    ratios = []
    for k in range(times):
        moment = (k + 0.5) / times + 1e-3
        static = Renderer(context, bake(frozen(model, moment), "texture", passes=True))
        for j in range(frames):
            camera, seconds = Camera(azimuth=30 + 360 * j / frames, elevation=20), []
            for renderer, options in ((moving, RenderOptions(time=moment)), (static, RenderOptions())):
                renderer.timed((side, side), camera, options)  # the first frame of a grid or a shader prepares it
                began = time.process_time()
                renderer.timed((side, side), camera, options)
                seconds.append(time.process_time() - began)
            ratios.append(seconds[1] / seconds[0])
        static.release()
    moving.release()
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    page.add(
        f"| {model.name} | {levels} | {1000 * finding:.0f} | {statistics.median(ratios):.2f} "
        f"| {min(ratios):.2f} to {max(ratios):.2f} |"
    )


def main() -> None:
    """Write the table for the models that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=model_path, nargs="+", metavar="M")
    parser.add_argument("--side", type=int, default=256, help="pixels per side (default 256)")
    parser.add_argument("--times", type=int, default=3, help="times of a motion (default 3)")
    parser.add_argument("--frames", type=int, default=4, help="frames at each time (default 4)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/motion_fps.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Frames of a model that moves",
        "",
        f"Printed by `python benchmarks/motion_fps.py {' '.join(path.stem for path in options.models)} "
        f"--side {options.side} --times {options.times} --frames {options.frames}`, {machine()}.",
        "",
        f"{options.side} x {options.side} pixels, one ray each, all levels, colours, weights in a texture, OSMesa. "
        "Beside the moving model a static one of the same size that draws the same picture: the moving one with that "
        "time folded into its biases; frames of both are drawn in turn, and their processor seconds compared. The "
        f"moving model has grids of empty cells for {MOMENTS} moments, found as they are needed (processor "
        "milliseconds for one) and mixed in between; the static model has one grid that is twice as fine. Holes are "
        "counted by motion_holes.py. `NAME, drifting`: a model of the gallery that is made to drift by the weights of "
        "its first layers.",
        "",
        "| model | levels | a grid, ms | frames per second, times the static model's | from, to |",
        "|---|---|---:|---:|---:|",
    )
    for path in options.models:
        model = load(path)
        moves = model.inputs == "xyzt"
        measure(page, model if moves else drifting(model), options.side, options.times, options.frames)


if __name__ == "__main__":
    main()
