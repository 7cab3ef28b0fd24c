"""Measure the quality of emitted weights against the bytes of Shadertoy text; writes docs/results/bytes.md.

    python benchmarks/bytes.py [--shapes armadillo,spot] [--steps 4000,6000] [--keep FOLDER] [-o FILE]
    python benchmarks/bytes.py --gallery [-o docs/results/shadertoy.md]

Decimals: trained as usual, then rounded to this number of decimals, as other generators do. Packed: weights are
quantized from the first step of training on, as in the presets `tiny` and `small`. With --gallery, nothing is trained:
the texts of the gallery's models are compared with texts of seven decimals.
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
from mplicits.field.rounding import in_decimals
from mplicits.mesher.extract import extract_model
from mplicits.mesher.metrics import SampledSurface, chamfer
from mplicits.model import gallery
from mplicits.model.model import Network, shape_of
from mplicits.model.model_file import load, save
from mplicits.model.quantize import step_of
from mplicits.trainer import settings
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import PRESETS, Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.train import Training
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context, open_osmesa
from protocol import DATA, Page, Truth, machine

SHAPES = {"armadillo": "meshes/armadillo.ply", "spot": "textured/spot.obj"}
PLAIN = (("16x2", 2), ("32x2", 2))
"""Levels, and decimals of weights."""
PACKED = ("24x2", "16x1,16x2", PRESETS["tiny"].levels, "20x1,32x2", "24x1,32x2", PRESETS["small"].levels)
TO_BEAT = (
    "Other generators on Armadillo, measured earlier with the same number of samples: Blackle's, 16x2, two decimals: "
    "3,989 bytes, 1.2e-3; three decimals: 4,613 bytes, 2.2e-4; nsdf small: 22.2 kB, 2.1e-4."
)


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


def write_gallery(output: Path) -> None:
    """Write the page of the gallery's models."""
    shadertoy = TARGETS["shadertoy"]
    page = Page(
        output,
        "# Shadertoy texts of the gallery",
        "",
        f"Printed by `python benchmarks/bytes.py --gallery`. {machine()}.",
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
        shapes = ", ".join(shape_of(level.network) for level in model.levels)
        assert model.texture is not None
        page.add(
            f"| {name} | {shapes} + {shape_of(model.texture)} | {len(text):,} | {studio} "
            f"| {len(decimals):,} | {bits} | {paid.distance:.1e} | {paid.largest:.1e} "
            f"| {paid.angle:.2f} | {paid.color:.1f} | {psnr:.1f} | {seconds:.1f} |"
        )


def _bits(network: Network) -> str:
    largest = [np.abs(layer.weight).max() / (step_of(layer.weight, 2047) or 1) for layer in network[1:-1]]
    return f"{np.log2(2 * max(largest) + 1):.1f}"


def main() -> None:
    """Train all networks, and write the page; or, with --gallery, the other one."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default="armadillo,spot")
    parser.add_argument("--steps", default="4000,6000")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=500_000)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder in which models stay for the next run")
    parser.add_argument("--gallery", action="store_true", help="compare texts of the gallery's models instead")
    parser.add_argument("-o", "--output", type=Path, help="default: docs/results/bytes.md, or shadertoy.md")
    options = parser.parse_args()
    if options.gallery:
        write_gallery(options.output or Path("docs/results/shadertoy.md"))
        return
    prepare(device("cpu"))
    page = Page(
        options.output or Path("docs/results/bytes.md"),
        "# Bytes of Shadertoy text against quality",
        "",
        f"Printed by `python benchmarks/bytes.py`. {machine()}.",
        "",
        "Bytes: of the whole text, ready to paste; tiny page: of `bake --target tiny`. "
        "Chamfer: of the weights as emitted, squared L2, both directions "
        f"summed, unit sphere, {options.samples:,} samples on each side, marching cubes at {options.resolution}^3; "
        "floor: that of two samplings of the mesh. Components: of that surface; the shapes have one. "
        f"{options.steps} steps for level 1 and each finer level.",
        "",
        TO_BEAT,
    )
    for name in options.shapes.split(","):
        path = options.data / SHAPES[name]
        shape, _ = load_shape(str(path))
        truth = Truth(path, shape, options.samples, 0)
        page.add(
            "",
            f"## {name}, floor {truth.floor:.2e}",
            "",
            "| levels | weights | bytes | tiny page | Chamfer | of the floor | components |",
            "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
        )
        for levels, digits in (*PLAIN, *((levels, None) for levels in PACKED)):
            sizes = settings.networks(levels)
            choices = Settings(
                sizes,
                settings.omegas(None, sizes),
                settings.steps(options.steps, len(sizes)),
                texture=False,
                packed=digits is None,
            )
            kept = options.keep and options.keep / f"{name}-{levels.replace(',', '-')}-{digits or 'packed'}.safetensors"
            if kept and kept.exists():
                model = load(kept)
            else:
                model = Training(shape, choices, TrainingBar(quiet=True)).run()
                if kept:
                    save(model, kept)
            size, page_size = (len(TARGETS[name](model, digits=digits).encode()) for name in ("shadertoy", "tiny"))
            extraction = extract_model(model if digits is None else in_decimals(model, digits), options.resolution)
            points, _ = SampledSurface(extraction.mesh).sample(options.samples, np.random.default_rng(1))
            distance = chamfer(points, truth.points)
            preset_name = next(
                (f", `{key}`" for key, preset in PRESETS.items() if preset.packed and preset.levels == levels), ""
            )
            kind = f"packed{preset_name}" if digits is None else f"{digits} decimals"
            page.add(
                f"| {levels.replace(',', ', ')} | {kind} | {size:,} | {page_size:,} | {distance:.2e} "
                f"| {distance / truth.floor:.2f} | {extraction.components} |"
            )


if __name__ == "__main__":
    main()
