"""Counts the holes of multiscale sphere tracing, by dense marching of the last level: writes docs/results/holes.md.

    python benchmarks/holes.py demo.safetensors armadillo.safetensors [--side 128] [--views 10] [-o FILE]

One round is the paper's single pass of 20 steps of level 1 and then 5 of each residual, with steps of 0.8 of the
field's value. More rounds let a ray that has left a band go back to the coarser level.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dense_view import STOP, closest_approach
from mplicits.codegen.targets.glsl330 import bake
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from protocol import Page, machine

ROUNDS = (1, 2, 4, 8, 16, 32)
"""Numbers of rounds, one row of the table each."""


def outline(hit: NDArray[np.bool_]) -> int:
    """Count the pixels of a picture (H, W) that have a neighbor on the other side of the silhouette."""
    edge = np.zeros_like(hit)
    for axis in (0, 1):
        for shift in (1, -1):
            edge |= hit ^ np.roll(hit, shift, axis)
    return int(edge.sum())


def measure(page: Page, model: Model, side: int, views: int) -> None:
    """Add one row to the table for each number of rounds. side: of a picture, in pixels; views: number of cameras."""
    program, renderer = lower(model), Renderer(open_osmesa(), bake(model))
    cameras = [Camera(azimuth=360 * i / views + 10, elevation=(-30, 0, 25, 50)[i % 4]) for i in range(views)]
    expected = [closest_approach(program, camera, side) for camera in cameras]
    edge = sum(outline(closest == 0) for closest in expected)
    covered = sum(int((closest == 0).sum()) for closest in expected)
    for rounds in ROUNDS:
        options = RenderOptions(shade="data", rounds=rounds, schedule="plain")
        pictures = [renderer.render((side, side), camera, options) for camera in cameras]
        hits = [picture[..., 3] > 0.5 for picture in pictures]
        holes = sum(int(((closest == 0) & ~hit).sum()) for closest, hit in zip(expected, hits, strict=True))
        extra = sum(int(((closest > STOP) & hit).sum()) for closest, hit in zip(expected, hits, strict=True))
        steps = np.concatenate([picture[..., 1].ravel() for picture in pictures])
        page.add(
            f"| {model.name} | {rounds} | {holes} ({100 * holes / covered:.2f} %) | "
            f"{extra} ({100 * (holes + extra) / edge:.2f} %) | {steps[steps > 0].mean():.1f} |"
        )


def main() -> None:
    """Write the table for the models that the command line names."""
    parser = argparse.ArgumentParser(description="holes of multiscale sphere tracing")
    parser.add_argument("models", type=Path, nargs="+", metavar="M.safetensors")
    parser.add_argument("--side", type=int, default=128, help="pixels per side (default 128)")
    parser.add_argument("--views", type=int, default=10, help="cameras around the shape (default 10)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/holes.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Holes of multiscale sphere tracing",
        "",
        f"Printed by `python benchmarks/holes.py {' '.join(path.name for path in options.models)}`. {machine()}.",
        "",
        "The models of `./run demo --train` and of `mplicits train armadillo.ply --levels 64x1,64x2 --seconds 150`, "
        f"{options.views} views of {options.side} x {options.side}, OSMesa. One round is the paper's single pass of "
        "20 and 5 steps, with steps of 0.8 f. Holes: dense marching meets the surface, tracing misses it. Extra: "
        "tracing hits, and the ray passes at over 1/20 pixel.",
        "",
        "| model | rounds | holes, of pixels hit | extra (holes and extra, of silhouette pixels) | mean steps |",
        "|---|---:|---:|---:|---:|",
    )
    for path in options.models:
        measure(page, load(path), options.side, options.views)


if __name__ == "__main__":
    main()
