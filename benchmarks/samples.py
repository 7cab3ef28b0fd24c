"""Compares samples that follow the edges with samples everywhere, by quality and work: writes docs/results/samples.md.

python benchmarks/samples.py spot-small lucy.safetensors ... [--side 512] [--add] [-o FILE]
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.orbit import AZIMUTH, ELEVATION
from mplicits.model.gallery import model_path
from mplicits.model.model import shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.supersampling import Image
from protocol import Page, machine

SIXTEEN = RenderOptions(samples=16)
WAYS = {
    "1": RenderOptions(),
    "4 everywhere": RenderOptions(samples=4, uniform=True),
    "16 along the edges": SIXTEEN,
    "16 everywhere": replace(SIXTEEN, uniform=True),
}


def decibels(picture: Image, truth: Image) -> float:
    """Return the peak signal-to-noise ratio of a picture's colours."""
    return float(-10 * np.log10(max(((picture - truth)[..., :3] ** 2).mean(), 1e-12)))


def main() -> None:
    """Draw every model in each way, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--add", action="store_true", help="add rows to the page that is there")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/samples.md"))
    args = parser.parse_args()
    head = [
        "# Samples that follow the edges",
        "",
        f"Printed by `benchmarks/samples.py`, one call for each model: {machine()}. Each model from its front, as many "
        "pixels a side as the table says, Phong, on OSMesa, weights in a texture. PSNR against 16 samples everywhere; "
        "work: the processor's time of the picture over that of 4 samples everywhere, in one process, once each, after "
        "a first picture that compiles.",
        "",
        "| model | levels | side | 4 everywhere | 16 along the edges | its work | work of 16 everywhere |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    page = Page(args.output, *(args.output.read_text().splitlines() if args.add else head))
    context = open_osmesa()
    for name in args.models:
        model = load(model_path(name))
        renderer = Renderer(context, bake(model, "texture", passes=True))
        camera, size = Camera(*(model.front or (AZIMUTH, ELEVATION))), (args.side, args.side)
        renderer.render((16, 16), camera)
        pictures: dict[str, Image] = {}
        seconds: dict[str, float] = {}
        for way, options in WAYS.items():
            began = time.process_time()
            pictures[way] = renderer.render(size, camera, options)
            seconds[way] = time.process_time() - began
        renderer.release()
        truth = pictures["16 everywhere"]
        few, many = (decibels(pictures[way], truth) for way in ("4 everywhere", "16 along the edges"))
        work, most = (seconds[way] / seconds["4 everywhere"] for way in ("16 along the edges", "16 everywhere"))
        networks = " > ".join(shape_of(level.network) for level in model.levels)
        page.add(
            f"| {model.name} | {networks} | {args.side} | {few:.1f} dB | {many:.1f} dB | {work:.2f} | {most:.2f} |"
        )


if __name__ == "__main__":
    main()
