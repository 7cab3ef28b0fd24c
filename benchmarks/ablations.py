"""Measures how loss weights and bands change a residual (Tables 5 to 8): writes docs/results/ablations.md.

    python benchmarks/ablations.py [--levels 32x1,32x2,64x2] [--steps 1500] [--multiples 0,0.1,1,10,100]
        [--factors 1.01,1.3,2,5] [--data FOLDER] [-o docs/results/ablations.md]

Each row changes one number and trains two networks. Medium is level 2; all rows share its level 1. Fine is level 3;
rows of Tables 5 to 7 share its level 2, and rows of Table 8 train their own. The factor is no option of `train`: it
scales the earlier bands in the model that training continues.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.field.interpret import nested_field
from mplicits.ir.lower import lower
from mplicits.model.model import DELTA_FACTOR, Model
from mplicits.trainer import sampling, settings
from mplicits.trainer.config import LossConfig
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from mplicits.trainer.train import Training
from protocol import DATA, Page, machine

POINTS = 100_000
"""Points of each measurement."""
SEEDS = 3
"""Number of trainings that show the noise."""
TABLES = {
    5: ("Eikonal (gradient) constraint", ("eikonal",)),
    6: ("normal constraint", ("normal",)),
    7: ("SDF constraint", ("value", "distance")),
}
"""Table -> its title, and the `LossWeights` that it varies. The SDF term is on and off the surface, as the paper's."""
WEIGHTS = ("0", "10", "30", "100", "300", "1000", "3000", "10000", "30000")
FACTORS = ("1.01", "1.05", "1.10", "1.20", "1.30", "1.50", "2.00", "5.00")
AS_PRINTED = {
    5: (
        WEIGHTS,
        (".0086", ".0084", ".0082", ".0078", ".0074", ".0069", ".0073", ".0087", ".0116"),
        (".0013", ".0013", ".0013", ".0012", ".0013", ".0014", ".0017", ".0022", ".0030"),
    ),
    6: (
        WEIGHTS,
        (".0073", ".0074", ".0077", ".0081", ".0083", ".0085", ".0086", ".0087", ".0087"),
        (".0017", *(".0013",) * 8),
    ),
    7: (
        WEIGHTS,
        (".0490", ".0080", ".0079", ".0079", ".0080", ".0081", ".0080", ".0082", ".0082"),
        (".0076", *(".0013",) * 4, ".0012", *(".0013",) * 3),
    ),
    8: (
        FACTORS,
        (".0098", ".0098", ".0100", ".0101", ".0103", ".0106", ".0113", ".0139"),
        (".0048", ".0048", ".0049", ".0049", ".0050", ".0051", ".0053", ".0066"),
    ),
}
"""Table -> the paper's first column, its errors of medium, and those of fine."""


class Study:
    """The shared levels, the points of measurement, and the training of a row."""

    def __init__(self, shape: Shape, options: argparse.Namespace) -> None:
        self._shape, self._steps, self._seed = shape, options.steps, options.seed
        self._sizes = settings.networks(options.levels)
        self._omegas = settings.omegas(None, self._sizes)
        self._coarse = self._refined(None, {}, self._seed)
        self._medium = self._refined(self._coarse, {}, self._seed)
        self._fine = self._refined(self._medium, {}, self._seed)
        self._truth = [self._points(self._medium), self._points(self._fine)]
        self.usual = self._cells(self._medium) + self._cells(self._fine)

    def row(self, weights: dict[str, float], seed: int | None = None) -> list[str]:
        """Train both residuals with these weights of the loss, and return their cells."""
        seed = self._seed if seed is None else seed
        return [
            cell
            for before in (self._coarse, self._medium)
            for cell in self._cells(self._refined(before, weights, seed))
        ]

    def banded_row(self, factor: float) -> list[str]:
        """Train both residuals in bands of half width factor * max |f|, and return their cells."""
        medium = self._refined(_banded(self._coarse, factor), {}, self._seed)
        return self._cells(medium) + self._cells(self._refined(_banded(medium, factor), {}, self._seed))

    def _refined(self, before: Model | None, weights: dict[str, float], seed: int) -> Model:
        """Train one more level after those of `before`."""
        count = 1 + (len(before.levels) if before else 0)
        choices = Settings(
            networks=self._sizes[:count],
            omegas=self._omegas[:count],
            steps=(self._steps,) * count,
            texture=False,
            seed=seed,
            device="cpu",
            weights=weights,
        )
        return Training(self._shape, choices, TrainingBar(quiet=True)).run(before)

    def _points(self, model: Model) -> tuple[tuple[Doubles, Doubles], ...]:
        """Draw points, with exact distances, on the surface, and in the last level's band at factor 1.

        Every row's last level is defined in that band. It is sampled as in training (Fig. 3a).
        """
        rng, last = np.random.default_rng(self._seed + 1), len(model.levels)
        narrow = lower(
            replace(model, levels=tuple(replace(level, delta=level.delta / DELTA_FACTOR) for level in model.levels))
        )

        def inside(points: Doubles) -> NDArray[np.bool_]:
            return np.asarray(nested_field(narrow, points.astype(np.float32), last)[1] == last)

        surface = self._shape.surface(POINTS, rng).points
        band = sampling.dithered(surface, narrow.bands[last - 2].delta, inside, POINTS, rng)
        return (surface, np.zeros(POINTS)), (band, self._shape.distance(band))

    def _cells(self, model: Model) -> list[str]:
        """Measure mean |f - distance| of the last level on the surface and in the band.

        Where the last level is not defined, the level before it is the answer, as in use.
        """
        level, program = len(model.levels), lower(model)
        restarts = model.provenance["levels"][-1]["restarts"]
        cells = []
        for points, distance in self._truth[level - 2]:
            f, _ = nested_field(program, points.astype(np.float32), level)
            cells.append(f"{np.abs(f - distance).mean():.2e}" + (f" ({restarts})" if restarts else ""))
        return cells


def _banded(model: Model, factor: float) -> Model:
    """Give the model's last level another factor in Eq. 5."""
    last = model.levels[-1]
    return replace(model, levels=(*model.levels[:-1], replace(last, delta=last.delta * factor / DELTA_FACTOR)))


def _head(title: str, first: str) -> list[str]:
    columns = [f"{level}, {where}" for level in ("medium", "fine") for where in ("surface", "band")]
    return ["", f"## {title}", "", f"| {first} | {' | '.join(columns)} |", "| ---" + " | ---:" * 4 + " |"]


def _as_printed(table: int) -> list[str]:
    values, medium, fine = AS_PRINTED[table]
    first = "factor" if table == 8 else "weight"
    return [
        "",
        "In the paper (other weights of the other terms):",
        "",
        f"| {first} | {' | '.join(values)} |",
        "| ---" + " | ---:" * len(values) + " |",
        f"| medium | {' | '.join(medium)} |",
        f"| fine | {' | '.join(fine)} |",
    ]


def _line(first: str, cells: Sequence[str]) -> str:
    return f"| {first} | {' | '.join(cells)} |"


def _numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


def main() -> None:
    """Write the four tables, each row as soon as it is trained."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--levels", default="32x1,32x2,64x2", metavar="NxD,NxD,NxD")
    parser.add_argument("--steps", type=int, default=1500, help="optimizer steps of every level")
    parser.add_argument(
        "--multiples", type=_numbers, default="0,0.1,1,10,100", help="factors on our weights of the loss"
    )
    parser.add_argument("--factors", type=_numbers, default="1.01,1.3,2,5", help="delta / max |f|")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/ablations.md"))
    options = parser.parse_args()
    if options.levels.count(",") != 2:
        parser.error("--levels: three levels are needed: coarse, medium, fine")
    prepare(device("cpu"))
    shape, _ = load_shape(str(options.data / "meshes" / "lucy.ply"))
    page = Page(
        options.output,
        "# Tables 5 to 8: the loss and the bands",
        "",
        f"Printed by `python benchmarks/ablations.py --levels {options.levels} --steps {options.steps} "
        f"--seed {options.seed}` on meshes/lucy.ply. {machine()}.",
        "",
        f"{options.levels}, {options.steps} steps a level. Medium is level 2, fine level 3. Figures are means of "
        f"abs(f - exact distance) at {POINTS:,} points, in radii of the shape: on the surface, and in the level's "
        "band at factor 1. (n): training collapsed n times and was restarted with a lower rate. A row of Table 8 has "
        "its factor in all earlier bands.",
    )
    study = Study(shape, options)
    page.add(*_head("Noise", "seed of the residual"), _line(f"{options.seed}", study.usual))
    for seed in range(options.seed + 1, options.seed + SEEDS):
        page.add(_line(f"{seed}", study.row({}, seed)))
    for table, (title, names) in TABLES.items():
        page.add(*_head(f"Table {table}: {title}", "times our weight (weight)"))
        for multiple in options.multiples:
            weights = {name: multiple * getattr(LossConfig.residual, name) for name in names}
            first = f"{multiple:g} ({', '.join(f'{weight:,g}' for weight in weights.values())})"
            page.add(_line(first, study.usual if multiple == 1 else study.row(weights)))
        page.add(*_as_printed(table))
    page.add(*_head("Table 8: delta factor", "delta / max abs f"))
    for factor in options.factors:
        page.add(_line(f"{factor:g}", study.usual if factor == DELTA_FACTOR else study.banded_row(factor)))
    page.add(*_as_printed(8))


if __name__ == "__main__":
    main()
