"""Compare contenders on ten meshes of Thingi32 with one set-up for all (Table 4); writes docs/results/table4.md.

    python benchmarks/table4.py [--levels 64x1,64x2] [--seconds 20] [--data FOLDER]

Every contender trains in the same process for the same number of seconds: our training; one SIREN of as many
parameters, by our loss; residuals without nested bands (the baseline of Section 4.2: SIREN's loss, in the whole
domain); a hash grid with a small MLP.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

from contenders import Trained, of_model, one_siren, ours, unnested
from hash_grid import hash_grid
from mplicits.model.errors import UserError
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA, Page, Truth, machine

OMEGAS = (30.0, 45.0, 128.0)
"""omega_0 of the levels of the baseline without bands (Section 4.2)."""


def contenders(options: argparse.Namespace) -> dict[str, Callable[[Shape], Trained]]:
    """Return the training of each column, by the column's name."""
    levels, seconds, seed = options.levels, options.seconds, options.seed

    def own(shape: Shape) -> Trained:
        model = ours(shape, levels, seconds, seed)
        return of_model("ours", model, model.provenance["seconds"])

    def single(shape: Shape) -> Trained:
        return of_model("one SIREN", one_siren(shape, parameters, seconds, seed), seconds)

    def plain(shape: Shape) -> Trained:
        began = time.perf_counter()
        model, steps = unnested(shape, levels, OMEGAS[: levels.count(",") + 1], seconds, seed)
        return of_model("without bands", model, time.perf_counter() - began, steps)

    sizes = [part.split("x") for part in levels.split(",")]
    parameters = sum(4 * int(n) + int(d) * int(n) * (int(n) + 1) + int(n) + 1 for n, d in sizes)
    return {
        "ours": own,
        "one SIREN": single,
        "residual without bands": plain,
        "hash grid": lambda shape: hash_grid(shape, 16, seconds, seed),
    }


def main() -> None:
    """Train all contenders on all meshes, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--meshes", metavar="ID,..", help="only these of the ten meshes")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=500_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table4.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    paths = sorted((options.data / "thingi32").glob("*.ply"), key=lambda path: int(path.stem))
    columns = contenders(options)
    omegas = ", ".join(f"{omega:g}" for omega in OMEGAS[: options.levels.count(",") + 1])
    page = Page(
        options.output,
        "# Table 4: one set-up for ten meshes of Thingi32",
        "",
        f"Printed by `python benchmarks/table4.py --seconds {options.seconds:g}`. {machine()}.",
        "",
        f"- Chamfer: squared L2, both directions summed, unit sphere, {options.samples:,} samples on each side, "
        f"marching cubes at {options.resolution}^3; in brackets, divided by the floor, which is that of two samplings "
        "of the truth.",
        f"- Levels {options.levels}; {options.seconds:g} s of training each, in turn.",
        "- One SIREN: the same number of parameters, omega_0 60, our loss and schedule.",
        f"- Residual without bands: omega_0 {omegas}, SIREN's loss on vertices and normals.",
        "- Hash grid: tables of 32,768 entries, 16 to 512 cells per side over sixteen levels, two hidden layers of 64, "
        "exact distances.",
        "",
        "| mesh | floor | " + " | ".join(columns) + " |",
        "| --- | ---: |" + " ---: |" * len(columns),
    )
    ratios: dict[str, list[float]] = {name: [] for name in columns}
    distances: dict[str, list[float]] = {name: [] for name in columns}
    parameters: dict[str, int] = {}
    floors = []
    for path in paths:
        if options.meshes and path.stem not in options.meshes.split(","):
            continue
        shape, _ = load_shape(str(path))
        truth = Truth(path, shape, options.samples, options.seed)
        floors.append(truth.floor)
        cells = []
        for name, train in columns.items():
            print(f"{path.stem}: {name}", file=sys.stderr)
            distance = float("inf")
            try:
                trained = train(shape)
                parameters[name] = trained.parameters
                distance, _ = truth.evaluate(trained, options.resolution)
            except UserError as error:
                print(error, file=sys.stderr)
            distances[name].append(distance)
            ratios[name].append(distance / truth.floor)
            cells.append("none" if distance == float("inf") else f"{distance:.2e} ({distance / truth.floor:.2f})")
        page.add(f"| {path.stem} | {truth.floor:.2e} | " + " | ".join(cells) + " |")
    means = (f"{statistics.mean(column):.2e}" for column in distances.values())
    page.add(f"| mean | {statistics.mean(floors):.2e} | " + " | ".join(means) + " |")
    medians = (f"{statistics.median(column):.2f}" for column in ratios.values())
    page.add("| median, of the floor | 1 | " + " | ".join(medians) + " |")
    page.add("| parameters | | " + " | ".join(f"{parameters.get(name, 0):,}" for name in columns) + " |")


if __name__ == "__main__":
    main()
