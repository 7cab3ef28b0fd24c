"""Compare where a budget of parameters goes, on one shape; adds to docs/results/capacity.md.

    python benchmarks/capacity.py CHOICE... [--seconds 150] [--shape FILE] [-o docs/results/capacity.md]

CHOICE: the options of a training as NAME=VALUE, those of `settings_from` by name, with spaces between:
"levels=64x1,96x2 omega=40,80 weights=eikonal=1". Without steps=, it is trained for --seconds of the processor. Rows
that the page has already are kept, those of other choices as well.
"""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import torch

from contenders import fully_trained
from levels import RESOLUTION, columns
from mplicits.model.model import Model
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.options import settings_from
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA, Page, machine


def train(choice: str, seconds: float, shape: Shape) -> tuple[Model, tuple[int, ...]]:
    """Train a shape as CHOICE says. Returns the model, and the optimiser steps of its networks."""
    options: dict[str, Any] = dict(part.split("=", 1) for part in choice.split())
    if "steps" not in options:
        options["seconds"] = seconds
    model = fully_trained(shape, settings_from(texture="none", **options))
    return model, tuple(record["steps"] for record in model.provenance["levels"])


def main() -> None:
    """Measure the rows that the page lacks, and write it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("choices", nargs="+", metavar="CHOICE")
    parser.add_argument("--seconds", type=float, default=150.0, metavar="S")
    parser.add_argument("--shape", type=Path, default=DATA / "meshes/armadillo.ply", metavar="FILE")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/capacity.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    lines = options.output.read_text(encoding="utf-8").splitlines() if options.output.exists() else []
    known = [line for line in lines if line.startswith("| ") and not line.startswith(("| shape", "| ---"))]
    page = Page(
        options.output,
        "# Where parameters go",
        "",
        "Printed by `python benchmarks/capacity.py CHOICE...`, once for each length: the options of `mplicits train` "
        "that differ from the defaults, and the seconds of the processor that a training was given, or its steps, by "
        f"{torch.get_num_threads()} thread(s), one seed. Mean abs f and angle are of held-out points of the surface; "
        f"Chamfer distance (of its floor), Hausdorff distance and components at {RESOLUTION}^3.",
        "",
        f"{machine()}.",
        "",
        "| shape | choice | given | parameters | seconds | steps | mean abs f | angle, degrees "
        "| Chamfer, of the floor | Hausdorff | components (truth) |",
        "| --- | --- | --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: |",
        *known,
    )
    for choice in options.choices:
        given = "steps" if "steps=" in choice else f"{options.seconds:g} s"
        start = f"| {options.shape.stem} | {choice} | {given} "
        if not any(line.startswith(start) for line in known):
            page.add(start + columns(options.shape, partial(train, choice, options.seconds)))


if __name__ == "__main__":
    main()
