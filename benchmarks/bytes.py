"""Measure the quality of emitted weights against the bytes of Shadertoy text; writes docs/results/bytes.md.

    python benchmarks/bytes.py [--shapes armadillo,spot] [--steps 4000,6000] [--keep FOLDER] [-o FILE]

Decimals: trained as always, then rounded to so many decimals, as others bake it. Packed: quantised by
model/quantise.py from the first step of training on, as the presets `tiny` and `small`.
"""

import argparse
from pathlib import Path

import numpy as np

from mplicits.codegen.reference.rounding import in_decimals
from mplicits.codegen.targets.registry import TARGETS
from mplicits.mesher.extract import extract_model
from mplicits.mesher.metrics import SampledSurface, chamfer
from mplicits.model.model import save
from mplicits.trainer import settings
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.settings import PRESETS, Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.train import Training
from protocol import DATA, Page, Truth, machine

SHAPES = {"armadillo": "meshes/armadillo.ply", "spot": "textured/spot.obj"}
PLAIN = (("16x2", 2), ("32x2", 2), ("64x1", 2), ("64x2", 2))
"""Levels, and decimals of their weights."""
PACKED = ("24x2", "16x1,16x2", PRESETS["tiny"].levels, "24x1,32x2", PRESETS["small"].levels)
TO_BEAT = (
    "Beside it, of others' tools on Armadillo, by an earlier measurement with as many samples: Blackle's generator, "
    "16x2, with two decimals 3,989 bytes and 1.2e-3, with three 4,613 bytes and 2.2e-4; nsdf small 22.2 kB and 2.1e-4."
)


def main() -> None:
    """Train all networks, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default="armadillo,spot")
    parser.add_argument("--steps", default="4000,6000")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=500_000)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save the models in")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/bytes.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Bytes of Shadertoy text against quality",
        "",
        "Printed by `python benchmarks/bytes.py`. Bytes: of the whole text, ready to paste. Chamfer: of "
        "the weights as emitted, squared L2, both directions summed, unit sphere, "
        f"{options.samples:,} samples on each side, marching cubes at {options.resolution}^3; floor: that of two "
        "samplings of the mesh. Pieces: components of that surface; the shapes have one. "
        f"{options.steps} steps for the first level and each finer one.",
        "",
        f"{machine()}.",
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
            "| levels | weights | bytes | Chamfer | of the floor | pieces |",
            "| --- | --- | ---: | ---: | ---: | ---: |",
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
            model = Training(shape, choices, TrainingBar(quiet=True)).run()
            if options.keep:
                save(model, options.keep / f"{name}-{levels.replace(',', '-')}-{digits or 'packed'}.safetensors")
            size = len(TARGETS["shadertoy"](model, digits=digits).encode())
            extraction = extract_model(model if digits is None else in_decimals(model, digits), options.resolution)
            points, _ = SampledSurface(extraction.mesh).sample(options.samples, np.random.default_rng(1))
            distance = chamfer(points, truth.points)
            preset_name = next(
                (f", `{key}`" for key, preset in PRESETS.items() if preset.packed and preset.levels == levels), ""
            )
            kind = f"packed{preset_name}" if digits is None else f"{digits} decimals"
            page.add(
                f"| {levels.replace(',', ', ')} | {kind} | {size:,} | {distance:.2e} "
                f"| {distance / truth.floor:.2f} | {extraction.components} |"
            )


if __name__ == "__main__":
    main()
