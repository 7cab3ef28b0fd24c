"""Measures the error of a training against its time: writes docs/results/quality.md.

    python benchmarks/quality.py armadillo.ply [--levels 64x1,64x2] [--seconds 60,150,300] [--keep FOLDER] [-o FILE]

Seconds count from reading the file to the last figure, as in `mplicits train --seconds`.
"""

import argparse
import time
from pathlib import Path

from contenders import trained, training_settings
from mplicits.model.model_file import save
from mplicits.model.surface_figures import surface_record
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.options import CREASE
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
        "Off by: mean of both directions between the surfaces of the model and of the shape, in radii of the shape. "
        "Normals by: mean angle between gradient and normal, degrees. Curved: against the surface that is trained; "
        "flat: against the file's faces. [What the figures mean](../training.md#what-the-figures-mean).",
        "",
        "| time limit, s | seconds | curved: off by | normals by | flat: off by | normals by | invented | steps |",
        "|---:|---:|---:|---:|---:|---:|---:|---|",
    )
    for seconds in map(float, arguments.seconds.split(",")):
        began = time.perf_counter()
        shape, _ = load_shape(arguments.shape, crease=CREASE)
        model = trained(shape, training_settings(arguments.levels, seconds=seconds), began)
        record = surface_record(model.provenance)
        assert record is not None
        told = [
            " | " if part is None else f"{part.distance:.2e} | {part.normal_angle:.2f}"
            for part in (record.shape, record.flat)
        ]
        steps = ", ".join(f"{level['network']}: {level['steps']:,}" for level in model.provenance["levels"])
        page.add(
            f"| {seconds:g} | {model.provenance['seconds']:.1f} | {' | '.join(told)} "
            f"| {record.shape.invented or 0:.2%} | {steps} |"
        )
        if arguments.keep:
            save(model, arguments.keep / f"{model.name}-{seconds:g}.safetensors")


if __name__ == "__main__":
    main()
