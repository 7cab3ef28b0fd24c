"""Measures the error of a training against its time, on held-out surface points: writes docs/results/quality.md.

    python benchmarks/quality.py armadillo.ply [--levels 64x1,64x2] [--seconds 60,150,300] [--keep FOLDER] [-o FILE]

Seconds count from reading the file to the last figure, as in `mplicits train --seconds`.
"""

import argparse
import time
from pathlib import Path

from contenders import trained, training_settings
from mplicits.model.model_file import save
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from protocol import Page, machine


def main() -> None:
    """Train once for each number of seconds, and write a row for each level."""
    parser = argparse.ArgumentParser(description="quality against training time")
    parser.add_argument("shape", metavar="SHAPE", help="a mesh, an oriented point cloud, or the word `demo`")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--seconds", default="60,150,300", metavar="S,..")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save the models in")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/quality.md"))
    arguments = parser.parse_args()
    prepare(device("cpu"))
    name = Path(arguments.shape).name
    page = Page(
        arguments.output,
        "# Error against training time",
        "",
        f"Printed by `python benchmarks/quality.py {name}`. {machine()}.",
        "",
        "Mean abs f and mean normal angle: at 100,000 surface points that training never sees, in radii of the shape.",
        "",
        "| time limit, s | seconds | level | steps | mean abs f | mean normal angle, degrees | delta |",
        "|---:|---:|---|---:|---:|---:|---:|",
    )
    for seconds in map(float, arguments.seconds.split(",")):
        began = time.perf_counter()
        shape, _ = load_shape(arguments.shape)
        model = trained(shape, training_settings(arguments.levels, seconds=seconds), began)
        for i, (level, record) in enumerate(zip(model.levels, model.provenance["levels"], strict=True), start=1):
            page.add(
                f"| {seconds:g} | {model.provenance['seconds']:.1f} | {i}: {record['network']} | {record['steps']} "
                f"| {record['mean_f']:.2e} | {record['angle']:.2f} | {level.delta:.4f} |"
            )
        if arguments.keep:
            save(model, arguments.keep / f"{model.name}-{seconds:g}.safetensors")


if __name__ == "__main__":
    main()
