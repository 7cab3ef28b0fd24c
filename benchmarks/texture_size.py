"""Measures textures of several sizes and frequencies, at equal work: writes docs/results/texture_size.md.

    python benchmarks/texture_size.py [--sizes 48x2,64x2,..] [--omegas 30,50,..] [--steps 1800] [--seeds 0]
        [-o docs/results/texture_size.md]

All textures are of Spot, on the levels of one model.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from contenders import training_settings
from mplicits.field.interpret import color
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.trainer import settings
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.options import CREASE
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.texture_detail import weights_of
from mplicits.trainer.train import Training
from protocol import DATA, Page, machine

POINTS = 200_000
"""Points of the surface at which colors are compared."""
LEVELS, LEVEL_STEPS = "32x1,48x2", "500,700"
"""Levels below the textures, whose surface hardly matters, and their steps."""
USUAL = (64, 2)
"""Size of the texture that takes the steps of `--steps`."""


def measure(model: Model, shape: Shape) -> float:
    """Return the PSNR of a model's colors at points of the surface, against the image there, dB."""
    drawn = shape.surface(POINTS, np.random.default_rng(1), colors=True)
    assert drawn.colors is not None
    found = np.clip(color(lower(model), drawn.points.astype(np.float32)), 0, 1)
    return float(-10 * np.log10(np.square(found - drawn.colors).mean()))


def train(shape: Shape, base: Model, plain: Settings, size: tuple[int, int], omega: float, steps: int) -> Model:
    """Train a texture of a size, a frequency and a number of steps on the levels of a model."""
    chosen = replace(
        plain,
        texture=True,
        texture_network=size,
        omegas=(*plain.omegas, omega),
        steps=(*plain.steps[:-1], steps),
    )
    return Training(shape, chosen, TrainingBar(quiet=True)).run(base)


def main() -> None:
    """Train and measure every size with every frequency."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sizes", default="48x2,64x2,96x2", metavar="NxD,..")
    parser.add_argument("--omegas", default="30,50,80,120", metavar="W,..")
    parser.add_argument("--steps", type=int, default=1800, metavar="N", help="of 64x2; other sizes get as much work")
    parser.add_argument("--seeds", default="0", metavar="K,..")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/texture_size.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    shape, _ = load_shape(str(DATA / "textured" / "spot.obj"), crease=CREASE)
    plain = training_settings(LEVELS, LEVEL_STEPS)
    base = Training(shape, plain, TrainingBar(quiet=True)).run()
    omegas = [float(text) for text in options.omegas.split(",")]
    page = Page(
        options.output,
        "# How wide a texture, and of which frequency",
        "",
        f"Printed by `python benchmarks/texture_size.py`. {machine()}.",
        "",
        f"Textures of Spot on one model ({LEVELS.replace(',', ' > ')}), with equal work: steps times weights are those "
        f"of {options.steps} steps of 64x2. PSNR, dB: colors of the network at {POINTS:,} points of the surface, "
        "against the image there, sRGB in [0, 1]; means of the trainings with seeds " + options.seeds + ".",
        "",
        "| size | weights | steps | " + " | ".join(f"omega {omega:g}" for omega in omegas) + " |",
        "| --- | ---: | ---: |" + " ---: |" * len(omegas),
    )
    for text in options.sizes.split(","):
        size = settings.networks(text)[0]
        steps = round(options.steps * weights_of(USUAL) / weights_of(size))
        cells = []
        for omega in omegas:
            seeds = (replace(plain, seed=int(seed)) for seed in options.seeds.split(","))
            found = [measure(train(shape, base, seeded, size, omega, steps), shape) for seeded in seeds]
            cells.append(f"{np.mean(found):.1f}")
        page.add(f"| {text} | {weights_of(size):,} | {steps} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
