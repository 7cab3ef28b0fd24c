"""Compare surface reconstructions of the Stanford meshes (Table 1); writes docs/results/table1.md.

    python benchmarks/table1.py [--levels 64x1,128x2] [--seconds 90] [--data FOLDER] [--keep FOLDER]

ours: as `mplicits train`; one training gives both rows, of which coarse is its level 1 alone. recipe: the paper's, in
the same process for the same number of seconds with the same networks: vertices and normals only, Eq. 4 with the
weights of its release, its omega_0, autograd. Both are meshed as by `mplicits mesh` and compared by the paper's
protocol.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

from contenders import Trained, of_model, ours, paper
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from protocol import DATA, Page, Truth, machine

SHAPES = {
    "armadillo": "Armadillo",
    "lucy": "Lucy, decimated to 100k faces",
    "xyzrgb_dragon": "Asian dragon, decimated to 28k faces",
    "happy_buddha": "Happy Buddha, closed, decimated to 100k faces",
    "bunny": "bunny",
}
OMEGAS = (40.0, 80.0, 100.0)
"""The paper's omega_0 of coarse, medium and fine (Section 4, implementation details)."""
PRINTED = {
    "armadillo": (("coarse", 1.38e-4, 2593, 4.97, 0.50), ("fine", 2.06e-4, 67_073, 5.42, 0.99)),
    "lucy": (("coarse", 3.28e-4, 4481, 1.81, 0.69), ("fine", 6.83e-5, 162_401, 10.36, 1.07)),
    "xyzrgb_dragon": (("coarse", 3.05e-5, 17_153, 8.60, 1.25), ("fine", 1.03e-5, 132_865, 28.70, 1.71)),
}
"""The paper's Table 1: row, Chamfer distance, parameters, minutes of training, seconds of sampling."""
HEAD = (
    "| shape | row | Chamfer | of the floor | parameters | training, s | steps | 512^3 sampling, s |",
    "| --- | --- | ---: | ---: | ---: | ---: | --- | ---: |",
)


def row(shape: str, trained: Trained, truth: Truth, resolution: int) -> str:
    """Evaluate a contender, and return its row."""
    distance, sampling = truth.evaluate(trained, resolution)
    steps = ", ".join(f"{count:,}" for count in trained.steps)
    return (
        f"| {shape} | {trained.name} | {distance:.2e} | {distance / truth.floor:.2f} | {trained.parameters:,} "
        f"| {trained.seconds:.0f} | {steps} | {sampling:.1f} |"
    )


def coarse(model: Model) -> Model:
    """Return the model of level 1 alone."""
    return replace(model, levels=model.levels[:1])


def compare(name: str, options: argparse.Namespace, page: Page) -> None:
    """Train and evaluate the contenders on one shape, and add its rows to the page."""
    path = options.data / "meshes" / f"{name}.ply"
    shape, _ = load_shape(str(path))
    truth = Truth(path, shape, options.samples, options.seed)
    page.add(f"| {SHAPES[name]} | floor | {truth.floor:.2e} | 1 | | | | |")
    print(f"{name}: ours", file=sys.stderr)
    model = ours(shape, options.levels, options.seconds, options.seed)
    most = PRINTED.get(name, PRINTED["armadillo"])[1][2]
    assert model.parameters() <= most, f"{name}: more than the {most} parameters of the paper's fine row"
    if options.keep:
        save(model, options.keep / f"{name}.safetensors")
    records = model.provenance["levels"]
    own = (
        of_model("ours, coarse", coarse(model), records[0]["seconds"], [records[0]["steps"]]),
        of_model("ours, fine", model, model.provenance["seconds"]),
    )
    for trained in own:
        page.add(row(SHAPES[name], trained, truth, options.resolution))
    began = time.perf_counter()
    print(f"{name}: recipe", file=sys.stderr)
    model, steps = paper(shape, options.levels, OMEGAS[: len(model.levels)], options.seconds, options.seed)
    seconds = time.perf_counter() - began
    theirs = (
        of_model("recipe, coarse", coarse(model), seconds / len(steps), steps[:1]),
        of_model("recipe, fine", model, seconds, steps),
    )
    for trained in theirs:
        page.add(row(SHAPES[name], trained, truth, options.resolution))
    for level, distance, parameters, minutes, sampling in PRINTED.get(name, ()):
        page.add(
            f"| {SHAPES[name]} | as printed, {level} | {distance:.2e} | | {parameters:,} | {minutes * 60:.0f} | "
            f"| {sampling:.2f} |"
        )


def main() -> None:
    """Compare all shapes, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--levels", default="64x1,128x2", metavar="NxD,..")
    parser.add_argument("--seconds", type=float, default=90)
    parser.add_argument("--shapes", default=",".join(SHAPES), metavar="NAME,..")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=500_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save our models in")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table1.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    omegas = ", ".join(f"{omega:g}" for omega in OMEGAS[: options.levels.count(",") + 1])
    page = Page(
        options.output,
        "# Table 1: surface reconstruction",
        "",
        f"Printed by `python benchmarks/table1.py`. {machine()}.",
        "",
        f"- Chamfer: squared L2, both directions summed, unit sphere, {options.samples:,} samples on each side, "
        f"marching cubes at {options.resolution}^3. Floor: two samplings of the ground truth.",
        f"- Levels {options.levels}; {options.seconds:g} s of training for each row `fine`, of which `coarse` is "
        "level 1.",
        "- `recipe`: the paper's, trained here for the same seconds: vertices and normals only, Eq. 4 (at level 1 "
        f"with the distance to the vertices), weights 3000, 100, 50, omega_0 {omegas}, Adam at 1e-4, batches of 8,192.",
        "- `as printed`: the paper's table; RTX 5090, the authors' copies of the meshes, point clouds as ground truth.",
        "",
        *HEAD,
    )
    for name in options.shapes.split(","):
        compare(name, options, page)


if __name__ == "__main__":
    main()
