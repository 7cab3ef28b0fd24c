"""Counts the holes in the frames of a model that moves, by dense marching: writes docs/results/motion_holes.md.

    python benchmarks/motion_holes.py spot-to-bob [--side 96] [--frames 60] [-o FILE]

Frame k of N shows time k / (N - 1), each from another side. Dense marching follows the last level of that moment.
"""

import argparse
from pathlib import Path

import numpy as np

from dense_view import ELEVATIONS, STOP, closest_approach, lost_and_extra
from moment import frozen
from mplicits.codegen.targets.glsl330 import bake
from mplicits.ir.lower import lower
from mplicits.model.gallery import model_path
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from protocol import Page, machine

TURN = 137.5
"""Degrees from the view of a frame to that of the next: all sides are seen, and no two frames from the same."""


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("model", type=model_path, metavar="M")
    parser.add_argument("--side", type=int, default=96, help="pixels per side (default 96)")
    parser.add_argument("--frames", type=int, default=60, help="frames (default 60)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/motion_holes.md"))
    options = parser.parse_args()
    model = load(options.model)
    renderer = Renderer(open_osmesa(), bake(model, "texture"))
    hits, lost, extra, bad = 0, 0, 0, []
    for k in range(options.frames):
        moment = k / (options.frames - 1)
        camera = Camera(azimuth=TURN * k % 360, elevation=ELEVATIONS[k % 4])
        picture = renderer.render((options.side,) * 2, camera, RenderOptions(shade="data", time=moment))
        closest = closest_approach(lower(frozen(model, moment)), camera, options.side)
        rays, near = picture.reshape(-1, 4), closest.reshape(-1)
        missed, beside = lost_and_extra(rays, near, np.full(len(rays), np.inf))
        hits, lost, extra = hits + int((near == 0).sum()), lost + missed, extra + beside
        if missed:
            bad.append(k)
    Page(
        options.output,
        "# Holes in the frames of a motion",
        "",
        f"Printed by `python benchmarks/motion_holes.py {options.model.stem} --side {options.side} --frames "
        f"{options.frames}`, {machine()}.",
    ).add(
        "",
        f"{options.frames} frames of {options.side} x {options.side} pixels, evenly spaced in time, each from another "
        f"side. Holes: dense marching of that moment meets the surface, and the frame has none. Extra: the frame has "
        f"surface, and the ray passes at over {STOP} pixel.",
        "",
        "| model | pixels that dense marching hits | holes | frames with holes | extra |",
        "|---|---:|---:|---|---:|",
        f"| {model.name} | {hits:,} | {lost} | {', '.join(map(str, bad)) or 'none'} | {extra} |",
    )


if __name__ == "__main__":
    main()
