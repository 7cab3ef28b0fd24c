"""Counts what rays pay for in a scene whose shapes' balls overlap more and more: writes docs/results/scenes.md.

    python benchmarks/scenes.py [-o docs/results/scenes.md]

Copies of one model stand in a row, and rays go to the first alone. They are traced in numpy; every evaluation of a
network is counted with its multiply-adds. What is printed is that over the same of a scene with the first copy alone.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from mplicits.field import composed
from mplicits.field.march import march
from mplicits.field.run import run
from mplicits.ir.lower import lower
from mplicits.ir.program import Array, Function, Program
from mplicits.scenes.composed import compose
from protocol import Page, machine

DISTANCES = (2.5, 2.0, 1.5, 1.0, 0.5)
"""Between the middles of neighbours, in radii of their balls: under 2 the balls overlap."""
RAYS = 4000
"""Towards the first shape's ball, side by side."""
PART = '[[parts]]\nmodel = "{}"\ntranslate = [{}, 0, 0]\n'


def work(model: str, places: list[float], joined: str = "") -> float:
    """Return the multiply-adds of the rays to the ball around the origin, of a model at places along x.

    joined: further keys of the scene.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.toml")
        path.write_text(joined + "".join(PART.format(model, place) for place in places))
        scene = compose(path)
    total = 0

    def counted(program: Program, function: Function, inputs: Array) -> Any:
        nonlocal total
        total += len(inputs) * program.cost(function).multiply_adds
        return run(program, function, inputs)

    rng = np.random.default_rng(0)
    angle, radius = rng.uniform(0, 2 * np.pi, RAYS), np.sqrt(rng.uniform(0, 1, RAYS))
    eye = np.array([0.0, 0.0, 8.0])
    rays = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(RAYS)], axis=1) - eye
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    with patch.object(composed, "run", counted):
        levels = len(scene.levels)
        march(lower(scene), (eye - scene.centre) / scene.scale, rays, levels, 0.002 / scene.scale)
    return float(total)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/scenes.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# What a scene's rays pay for",
        "",
        f"Printed by `benchmarks/scenes.py`: {machine()}. {RAYS:,} rays to the ball of one model, which has copies to "
        "its right; multiply-adds of all networks that they ask, over those of the scene with that model alone. "
        "Distances are between neighbours' middles, in radii: under 2 their balls overlap. Counted in numpy, without "
        "grids of empty cells; nothing was measured on a GPU.",
        "",
        "| model | joined by | " + " | ".join(f"distance {distance:g}" for distance in DISTANCES) + " |",
        "| --- | --- |" + " ---: |" * len(DISTANCES),
    )
    rows = (("two", 2, "union"), ("three", 3, "union"), ("three", 3, "smooth union"))
    for model in ("spot-small", "bob-small"):
        alone = work(model, [0.0])
        for name, count, operation in rows:
            joined = f'operation = "{operation}"\n' + ("radius = 0.2\n" if operation == "smooth union" else "")
            shares = [work(model, [i * distance for i in range(count)], joined) / alone for distance in DISTANCES]
            page.add(f"| {name} {model} | {operation} | " + " | ".join(f"{share:.2f}" for share in shares) + " |")
    page.add(
        "",
        "A point in several balls is asked of each of their shapes, so that where all overlap everywhere a scene costs "
        "as much as its shapes together, and less where rays leave some of the balls. Shapes whose balls a ray passes "
        "by cost no evaluations; beside them its steps are shorter.",
    )


if __name__ == "__main__":
    main()
