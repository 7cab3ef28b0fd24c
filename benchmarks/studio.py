"""Compares the page that trains with the command line, shape by shape: writes docs/results/studio.md.

    PYTHONPATH=tests python benchmarks/studio.py [--shapes NAME,..] [--seconds S] [--repeat N] [--keep FOLDER] [-o FILE]
    PYTHONPATH=tests python benchmarks/studio.py --picture docs/studio.png

Each shape is trained in headless Chromium, then by `mplicits train`, for the same seconds; leave the machine alone
meanwhile. The same code measures both models. The page of results is written after every shape.
"""

import argparse
import io
import subprocess
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

import studio_page
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.mesher.evaluation import evaluate
from mplicits.mesher.metrics import angles
from mplicits.mesher.options import EvalOptions
from mplicits.model.files import write_whole
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA
from studio_report import POINTS, SAMPLES, Result, Row, page_row, report, table_rows

PICTURE = "spot"
"""Shape of the picture."""
VIEW = "#az=215&el=15"
"""Hash of the page's address in the picture."""


@dataclass(frozen=True)
class Case:
    """A shape of the table."""

    files: tuple[str, ...] = ()
    """In the data folder, the shape's first, then those that it names; none: an example of the page."""
    preset: str = "base"
    seconds: float = 60
    built_in: bool = False
    """Whether `mplicits train demo` has the shape, and the page trains it by its button."""


CASES = {
    "bunny": Case(("meshes/bunny.ply",)),
    "armadillo": Case(("meshes/armadillo.ply",)),
    "spot": Case(tuple(f"textured/{name}" for name in ("spot.obj", "spot.mtl", "spot_texture.png"))),
    "gear": Case(),
    "64764": Case(("thingi32/64764.ply",)),
    "rope": Case(preset="tiny", seconds=10, built_in=True),
}


class Truth:
    """A shape's file, as it is and as both sides curve it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.flat, _ = load_shape(str(path), crease=None)
        self.curved, _ = load_shape(str(path), crease=CREASE)

    def measure(self, file: Path, seconds: float) -> Row:
        """Measure the model in a file. seconds: of its training."""
        # Both sides train the curved surface, in its model space; `demo` has no file whose place it could name.
        model = replace(load(file), center=self.curved.center, scale=self.curved.scale)
        flat_f, flat_angle, colors = on_surface(model, self.flat)
        curved_f, curved_angle, _ = on_surface(model, self.curved)
        figures = evaluate(model, self.path, EvalOptions(samples=SAMPLES, quiet=True)).figures
        return Row(
            seconds=seconds,
            steps=model.provenance["levels"][-1]["steps"],
            flat_f=flat_f,
            flat_angle=flat_angle,
            curved_f=curved_f,
            curved_angle=curved_angle,
            chamfer=figures.chamfer / figures.floor,
            components=figures.components,
            colors=colors,
        )


def on_surface(model: Model, shape: Shape) -> tuple[float, float, float]:
    """Measure a model at points of its shape. Returns mean |f|, mean angle, and the colors' mean squared error."""
    drawn = shape.surface(POINTS, np.random.default_rng(0), held_out=True, colors=shape.colored)
    points = (drawn.points * shape.scale + np.array(shape.center) - np.array(model.center)) / model.scale
    points, program = points.astype(np.float32), lower(model)
    gradient, f = interpret.field_gradient(program, points, len(model.levels))
    directions = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    error = float("nan")
    if drawn.colors is not None and model.colored:
        error = float(np.square(interpret.color(program, points) - drawn.colors).mean())
    return float(np.abs(f).mean()), float(angles(directions, drawn.normals).mean()), error


def in_page(case: Case, name: str, path: Path, seed: int, output: Path) -> studio_page.Watched:
    """Train in the page, and save the model. path: the shape's file."""
    files = studio_page.EXAMPLES[name] if case.built_in else [path, *(DATA / more for more in case.files[1:])]
    with tempfile.TemporaryDirectory() as folder, studio_page.opened(Path(folder)) as visited:
        watched = studio_page.train(visited, files, case.preset, case.seconds, seed)
        studio_page.save(visited, output)
    return watched


def by_command(case: Case, path: Path, seed: int, output: Path) -> float:
    """Train by `mplicits train`. Returns the seconds of its process."""
    shape = "demo" if case.built_in else str(path)
    command = [sys.executable, "-m", "mplicits", "train", shape, "-o", str(output), "--force", "--quiet"]
    command += ["--preset", case.preset, "--seconds", f"{case.seconds:g}", "--seed", str(seed)]
    began = time.perf_counter()
    subprocess.run(command, check=True)
    return time.perf_counter() - began


def compare(case: Case, name: str, repeat: int, folder: Path) -> Result:
    """Train a shape in the page and by the command, in turn, and measure the models, which stay in `folder`."""
    if case.files:
        path = DATA / case.files[0]
    else:
        path = folder / f"{name}.ply"
        studio_page.write_example(name, path)
    truth, result = Truth(path), Result([], [], [])
    for seed in range(repeat):
        ours, theirs = (folder / f"{name}-{seed}-{side}.safetensors" for side in ("page", "train"))
        watched = in_page(case, name, path, seed, ours)
        print(f"{name}: {watched}", file=sys.stderr)
        seconds = by_command(case, path, seed, theirs)
        result.watched.append(watched)
        result.page.append(truth.measure(ours, watched.seconds))
        result.command.append(truth.measure(theirs, seconds))
    return result


def picture(path: Path, case: Case) -> None:
    """Train a shape in the page, and save a picture of the page."""
    files = [DATA / name for name in case.files]
    with tempfile.TemporaryDirectory() as folder, studio_page.opened(Path(folder), "light") as visited:
        studio_page.train(visited, files, case.preset, case.seconds)
        visited.follow(VIEW)
        visited.still()
        taken = Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB")
    stream = io.BytesIO()
    taken.save(stream, "PNG", optimize=True)
    write_whole(path, stream.getvalue())


def main() -> None:
    """Write the table, or the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default=",".join(CASES), metavar="NAME,..")
    parser.add_argument("--seconds", type=int, help="of every training (default: 60; 10 for the rope)")
    parser.add_argument("--repeat", type=int, default=1, help="trainings of each shape; the table has medians")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder for the models")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw the page after a training, and no more")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/studio.md"))
    options = parser.parse_args()
    names = options.shapes.split(",")
    if unknown := [name for name in names if name not in CASES]:
        parser.error(f"--shapes: no shape is called {unknown[0]}; there are {', '.join(CASES)}")
    cases = {name: replace(case, seconds=options.seconds or case.seconds) for name, case in CASES.items()}
    if options.picture:
        picture(options.picture, cases[PICTURE])
        return
    given = {key: getattr(options, key) for key in ("shapes", "seconds", "repeat")}
    changed = "".join(f" --{key} {value}" for key, value in given.items() if value != parser.get_default(key))
    rows: list[str] = []
    page_rows: list[str] = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        report(options.output, changed, options.repeat, rows, page_rows)
        for name in names:
            case = cases[name]
            try:
                result = compare(case, name, options.repeat, folder)
            except Exception as error:  # one shape must not lose the others
                traceback.print_exc()
                rows.append(f"| {name} | failed: {str(error).splitlines()[0][:80]} |" + " |" * 10)
            else:
                rows += table_rows(name, case.preset, result)
                page_rows.append(page_row(name, result.watched))
            report(options.output, changed, options.repeat, rows, page_rows)


if __name__ == "__main__":
    main()
