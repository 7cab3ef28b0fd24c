"""Measure the quality that training reaches in a given time, on held-out points of the surface; prints a table.

    python benchmarks/quality.py armadillo.ply [--levels 64x1,64x2] [--seconds 60,150,300] [--keep FOLDER]

Seconds count from reading the file to the last figure, as in `mplicits train --seconds`.
"""

import argparse
import time
from pathlib import Path

from contenders import fully_trained, training_settings
from mplicits.model.model_file import save
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from protocol import machine


def main() -> None:
    """Train once for each number of seconds, and print a row for each level."""
    parser = argparse.ArgumentParser(description="quality against training time")
    parser.add_argument("shape", metavar="SHAPE", help="a mesh, an oriented point cloud, or the word `demo`")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--seconds", default="60,150,300", metavar="S,..")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save the models in")
    arguments = parser.parse_args()
    prepare(device("cpu"))
    print(f"{Path(arguments.shape).name}, {machine()}\n")
    print("| seconds asked | seconds | level | steps | mean abs f | mean normal angle, degrees | delta |")
    print("|---:|---:|---|---:|---:|---:|---:|", flush=True)
    for seconds in map(float, arguments.seconds.split(",")):
        began = time.perf_counter()
        shape, _ = load_shape(arguments.shape)
        asked = training_settings(arguments.levels, seconds=seconds)
        model = fully_trained(shape, asked, began)
        for i, (level, record) in enumerate(zip(model.levels, model.provenance["levels"], strict=True), start=1):
            print(
                f"| {seconds:g} | {model.provenance['seconds']:.1f} | {i}: {record['network']} | {record['steps']} "
                f"| {record['mean_f']:.2e} | {record['angle']:.2f} | {level.delta:.4f} |",
                flush=True,
            )
        if arguments.keep:
            save(model, arguments.keep / f"{model.name}-{seconds:g}.safetensors")


if __name__ == "__main__":
    main()
