"""Measures the grain of trained normals, and their errors at creases: writes docs/results/grain.md.

    python benchmarks/grain.py [--shapes sphere,bunny,..] [--surface] [--models FOLDER [--ready]]
        [-o docs/results/grain.md]
    python benchmarks/grain.py --shapes bunny --trial step.batch=8192 --trial omega=25,40 mean=0.2 [--seeds 0,1]

The page compares the default frequencies, which follow the shape, with equal ones for every shape. --trial measures
other settings instead. Its keys: levels, omega: as the options of `train`; a hyperparameter of `trainer/config.py` by
its path, such as loss.residual.normal; mean: share of the schedule over whose end the weights are averaged. --models
FOLDER reads the models that are in FOLDER; missing ones are trained and saved there, or with --ready left out.
"""

import argparse
import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from contenders import training_settings
from grain_errors import FILES, Truth, measure
from grain_shapes import SHARP, SOLIDS
from mplicits.mesher.compare import compare
from mplicits.mesher.extract import extract_model
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.model.model import Model
from mplicits.model.model_file import load, save
from mplicits.trainer import settings
from mplicits.trainer.config import default_config
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.networks.callback import Callback, FitState
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import PRESETS
from mplicits.trainer.suited_omegas import with_suited_omegas
from mplicits.trainer.train import Training
from protocol import Page, machine

USUAL = "omega=34.6,80"
"""The frequencies of every shape before they followed the shape."""
TRIALS = {
    "cube": ("omega=25,40", "omega=15,20", "omega=8,8"),
    "gear": ("omega=25,40", "omega=15,20"),
    "torus": ("omega=25,40", "omega=15,20"),
    "bunny": (
        "omega=25,40",
        "omega=15,20",
        f"{USUAL} mean=0.1",
        f"{USUAL} mean=0.3",
        f"{USUAL} loss.residual.normal=400",
        f"{USUAL} loss.residual.eikonal=30",
        "omega=34.6,60 levels=48x1,90x2",
        f"{USUAL} levels=48x1,128x4",
    ),
    "spot": ("omega=25,40",),
}
"""Further trials of the page: keys of --trial."""
LOSS = default_config().loss.residual
"""Weights of a residual's loss that trials change."""
QUICK = (
    "step.batch=2048",
    "measuring.points=20000",
    "measuring.band_points=20000",
    "measuring.field_points=2000",
    "measuring.lipschitz_points=10000",
    "mining.components=[]",
    "mining.candidates=50000",
    "mining.thin.candidates=100000",
    "sampling.largest_pool=100000",
    "sampling.stray_candidates=100000",
)
"""Settings of all trials: half a batch, and less work beside the steps."""
RESOLUTION, SAMPLES = 256, 100_000
"""Resolution of marching cubes, and samples of each surface."""


class MeanOfWeights(Callback):
    """Replaces the weights of a network by their mean over the end of its schedule."""

    def __init__(self, share: float, steps: tuple[int, ...]) -> None:
        """share: of the schedule. steps: of each network."""
        self._share, self._steps = share, list(steps)
        self._sums, self._count = list[Any](), 0

    def after_step(self, state: FitState) -> None:
        """Add the weights, and set them at the last step."""
        last = self._steps[0]
        if state.steps <= last * (1 - self._share):
            return
        if not self._count:
            self._sums = [weight * 0 for weight in state.weights]
        self._sums = [total + weight for total, weight in zip(self._sums, state.weights, strict=True)]
        self._count += 1
        if state.steps == last:
            for total, weight in zip(self._sums, state.weights, strict=True):
                weight.copy_(total / self._count)
            del self._steps[0]
            self._count = 0


@dataclass(frozen=True)
class Trial:
    """How a shape is trained."""

    keys: tuple[str, ...]
    """KEY=VALUE; none: the defaults."""
    steps: str
    """As --steps of `mplicits train` takes them."""
    seed: int

    @property
    def name(self) -> str:
        """The keys in one text."""
        return " ".join(self.keys) or "default"

    def train(self, truth: Truth) -> Model:
        """Train a shape."""
        chosen = dict(key.split("=", 1) for key in (*QUICK, *self.keys))
        plain = training_settings(chosen.pop("levels", PRESETS["base"].levels), self.steps, seed=self.seed)
        progress, callbacks, config = TrainingBar(quiet=True), list[Callback](), default_config()
        if omega := chosen.pop("omega", None):
            plain = replace(plain, omegas=settings.omegas(omega, plain.networks))
        else:
            plain = with_suited_omegas(truth.shape, plain)
        if share := chosen.pop("mean", None):
            callbacks.append(MeanOfWeights(float(share), plain.steps))
        for path, value in chosen.items():
            config = with_value(config, path.split("."), json.loads(value))
        return Training(truth.shape, plain, progress, callbacks=callbacks, config=config).run()


def with_value(config: Any, path: list[str], value: Any) -> Any:
    """Return a config, a dataclass of dataclasses, with another value at a path of names."""
    name, *rest = path
    return replace(config, **{name: with_value(getattr(config, name), rest, value) if rest else value})


def trained(truth: Truth, trial: Trial, folder: Path | None, ready: bool) -> Model | None:
    """Read a trial's model from a folder, or train it, and put it there. ready: do not train; None: there is none."""
    file = None if folder is None else folder / f"{truth.path.stem}-{trial.name}-{trial.seed}.safetensors"
    if file is not None and file.exists():
        return load(file)
    if ready:
        return None
    model = trial.train(truth)
    if file is not None:
        save(model, file)
    return model


def surface_cells(model: Model, truth: Truth) -> str:
    """Return the cells of a table that need the model's mesh: components, and Chamfer distance."""
    true = in_model_space(read_mesh(truth.path), *model.place)
    figures = compare(extract_model(model, RESOLUTION).mesh, true, SAMPLES)
    return f"{figures.components} ({figures.truth_components}) | {figures.chamfer / figures.floor:.2f}"


def main() -> None:
    """Train and measure every shape by every trial."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default=",".join((*SOLIDS, *FILES)), metavar="NAME,..")
    parser.add_argument("--trial", nargs="*", action="append", metavar="KEY=VALUE")
    parser.add_argument("--steps", default="1000,1400", metavar="N,..")
    parser.add_argument("--seeds", default="0", metavar="K,..")
    parser.add_argument("--surface", action="store_true", help="components and Chamfer distance of sharp shapes, too")
    parser.add_argument("--ready", action="store_true", help="measure the models in --models alone")
    parser.add_argument("--models", type=Path, metavar="FOLDER", help="models to measure, and where to put others")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/grain.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    page = Page(options.output, *head(options))
    with tempfile.TemporaryDirectory() as folder:
        for name in options.shapes.split(","):
            truth = Truth(name, Path(folder))
            usual = [(USUAL,), *(tuple(trial.split()) for trial in TRIALS.get(name, ())), ()]
            for keys in [tuple(trial) for trial in options.trial or usual]:
                for seed in map(int, options.seeds.split(",")):
                    trial = Trial(keys, options.steps, seed)
                    model = trained(truth, trial, options.models, options.ready)
                    if model is None:
                        continue
                    omegas = ", ".join(f"{record['omega']:g}" for record in model.provenance["levels"])
                    surface = surface_cells(model, truth) if options.surface and name in SHARP else " | "
                    cells = measure(model, truth).cells()
                    page.add(f"| {name} | {trial.name} | {omegas} | {seed} | {cells} | {surface} |")


def head(options: argparse.Namespace) -> list[str]:
    """Return the page's head."""
    waves = ("below 0.06", "0.06 to 0.11", "0.11 to 0.23", "above 0.23")
    return [
        "# Grain, flats and creases",
        "",
        f"Printed by `python benchmarks/grain.py --shapes {options.shapes}{' --surface' * options.surface}`.",
        f"{machine()}.",
        "",
        f"Networks {PRESETS['base'].levels}, {options.steps} steps of 2,048 samples, no search for loose components. "
        "Angles are errors of the field's normals at 200,000 points of the surface, degrees. True normals: by formula "
        "for sphere and torus, of the curved mesh for others (`--crease 30`).",
        "",
        "- Grain: the error without its mean over a disk of 0.02 radii, root mean square. The next four columns split "
        "the error by wavelength, in radii, where the shape is smooth: in the half of the surface whose normals differ "
        "least from their mean over that disk.",
        "- Flats: mean error farther than 0.03 from creases (edges that bend by more than 30 degrees). At creases: "
        "nearer than 0.015.",
        f"- Components (in brackets: of the truth), Chamfer distance: marching cubes at {RESOLUTION}^3, {SAMPLES:,} "
        "samples.",
        f"- Trial: default, as `mplicits train` does; {USUAL}: the frequencies of every shape before; mean: of "
        "the weights over this share of the steps, the last ones; loss.residual.normal, .eikonal: weights, by default "
        f"{LOSS.normal:g} and {LOSS.eikonal:g}.",
        "",
        "| shape | trial | omega | seed | mean abs f | mean distance | angle | grain "
        + "".join(f"| {wave} " for wave in waves)
        + "| flats | at creases | components | Chamfer, of the floor |",
        "| --- | --- | --- |" + " ---: |" * 13,
    ]


if __name__ == "__main__":
    main()
