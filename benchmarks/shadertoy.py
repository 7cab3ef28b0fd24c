"""Compares the gallery's Shadertoy texts with texts of seven decimals: writes docs/results/shadertoy.md.

python benchmarks/shadertoy.py [-o docs/results/shadertoy.md]
"""

import argparse
import time
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets.shadertoy import WIDEST
from mplicits.field.bits import cost, fewest_bits
from mplicits.model import gallery
from mplicits.model.model import Network, size_text
from mplicits.model.model_file import load
from mplicits.model.quantize import step_of
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context, open_osmesa
from protocol import Page, machine

SIDE = 600
"""Pixels along each side of the pictures that are compared."""
INPUTS = "uniform vec3 iResolution; uniform float iTime; uniform vec4 iMouse; uniform int iFrame;\n"
MAIN = "out vec4 c; void main() { if (iResolution.x < 0.) discard; mainImage(c, gl_FragCoord.xy); }\n"


def picture(context: Context, text: str) -> NDArray[np.float64]:
    """Draw the first picture of a Shadertoy text. Returns (SIDE, SIDE, 3), whole numbers from 0 to 255."""
    with context as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader="#version 330\n" + INPUTS + text + MAIN)
        program["iResolution"] = SIDE, SIDE, 1
        target = gl.framebuffer([gl.texture((SIDE, SIDE), 4, dtype="f4")])
        target.use()
        gl.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
        drawn = np.frombuffer(target.read(components=3, dtype="f4"), np.float32).reshape(SIDE, SIDE, 3)
    return np.rint(255 * drawn.clip(0, 1).astype(np.float64))


def _bits(network: Network) -> str:
    largest = [np.abs(layer.weight).max() / (step_of(layer.weight, 2047) or 1) for layer in network[1:-1]]
    return f"{np.log2(2 * max(largest) + 1):.1f}"


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/shadertoy.md"))
    shadertoy = TARGETS["shadertoy"]
    page = Page(
        parser.parse_args().output,
        "# Shadertoy texts of the gallery",
        "",
        f"Printed by `python benchmarks/shadertoy.py`. {machine()}.",
        "",
        "- Bytes: of the whole text with Phong's shading; with the studio, where `bake` adds it; with the fewest "
        "decimals that keep the surface.",
        "- Bits: log2 of the number of values of a hidden weight, for each level and the texture.",
        "- Error: root mean square and largest abs(f - f packed) near the surface, in radii of the shape; angle "
        "between normals; colors of 255.",
        f"- PSNR: of the first picture, {SIDE} x {SIDE}, against that with seven decimals. Seconds: of `bake`, "
        "processor.",
        "",
        "| model | levels + texture | bytes | with the studio | with decimals | bits | error of f | largest "
        "| normals, degrees | colors | PSNR, dB | s |",
        "| --- | --- | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    )
    context = open_osmesa()
    for name in gallery.names():
        model = load(gallery.model_path(name))
        if max(layer.weight.shape[0] for network in model.networks().values() for layer in network) > WIDEST:
            page.add(f"| {name} | | too wide | | | | | | | | | |")
            continue
        if model.inputs == "xyzt":
            page.add(f"| {name} | | moves: has decimals | | | | | | | | | |")
            continue
        began = time.process_time()
        lit = shadertoy(model)
        seconds = time.process_time() - began
        text = shadertoy(model, shade="phong")
        decimals = shadertoy(model, "literal", shade="phong")
        studio = f"{len(lit):,}" if len(lit) > len(text) else "left out"
        packed = fewest_bits(model)
        assert packed is not None
        paid = cost(model, packed)
        difference = picture(context, text) - picture(context, shadertoy(model, "literal", 7, shade="phong"))
        psnr = 10 * np.log10(255**2 / np.square(difference).mean())
        bits = ", ".join(_bits(network) for network in packed.networks().values())
        shapes = ", ".join(size_text(level.network) for level in model.levels)
        assert model.texture is not None
        page.add(
            f"| {name} | {shapes} + {size_text(model.texture)} | {len(text):,} | {studio} "
            f"| {len(decimals):,} | {bits} | {paid.distance:.1e} | {paid.largest:.1e} "
            f"| {paid.angle:.2f} | {paid.color:.1f} | {psnr:.1f} | {seconds:.1f} |"
        )


if __name__ == "__main__":
    main()
