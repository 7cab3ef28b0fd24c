"""Frames per second of the CUDA target (the paper's Table 2); writes docs/results/table2.md.

    python benchmarks/table2.py MODELS [--seconds 150] [--size 512] [-o FILE]

MODELS is a folder for the models of MODELS_OF below; those that are missing are trained there first, on Armadillo
(`meshes/armadillo.ply` of the data), for --seconds each. NM in a row's title means that the last level is not traced
and only gives the normals. Every variant of a row runs in one process, and the frames of fused are compared with those
of simple, which is float32. Without a GPU the cells say so.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mplicits.model.model_file import load
from nvcc import NOT_RUN, build, gpu
from protocol import DATA, Page, machine

MODELS_OF = {
    "siren": "256x4",
    "coarse": "64x2",
    "two-128": "64x2,128x2",
    "two-256": "64x2,256x2",
    "three": "64x2,128x2,256x2",
}
"""Name of a model -> its levels, as `mplicits train --levels` takes them."""
ROWS: tuple[tuple[str, str, tuple[int, int], int], ...] = (
    ("(256, 4), SIREN", "siren", (1, 1), 37),
    ("(64, 2)", "coarse", (1, 1), 315),
    ("(64, 2) > (128, 2), NM", "two-128", (1, 2), 177),
    ("(64, 2) > (128, 2)", "two-128", (2, 2), 150),
    ("(64, 2) > (256, 2), NM", "two-256", (1, 2), 94),
    ("(64, 2) > (256, 2)", "two-256", (2, 2), 75),
    ("(64, 2) > (128, 2) > (256, 2), NM", "three", (2, 3), 86),
    ("(64, 2) > (128, 2) > (256, 2)", "three", (3, 3), 70),
)
"""Title, model, (level, normal level), the paper's frames per second on an RTX 5090 at 512 x 512."""
VARIANTS = ("simple", "fused", "layered", "layered-one-round")
"""The columns of frames per second, by the names that --benchmark gives them."""


def train(path: Path, levels: str, seconds: float) -> None:
    """Train a model with these levels and write it to `path`, unless it is there already."""
    if path.exists():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    shape = DATA / "meshes" / "armadillo.ply"
    subprocess.run(
        [
            sys.executable,
            "-m",
            "mplicits",
            "train",
            str(shape),
            "--levels",
            levels,
            "--seconds",
            f"{seconds:g}",
            "-o",
            str(path),
        ],
        check=True,
    )


def psnr(ours: Path, theirs: Path) -> float:
    """Return the peak signal-to-noise ratio of two pictures of one size, dB."""
    a, b = (np.asarray(Image.open(path), float) for path in (ours, theirs))
    return float(10 * np.log10(255**2 / max(1e-9, float(((a - b) ** 2).mean()))))


def measured(report: dict[str, Any], folder: Path, size: int) -> list[str]:
    """Return a row's cells: frames per second of VARIANTS, then TFLOP/s, share of the peak and PSNR of fused.

    report: what --benchmark printed; folder: where it wrote its frames; size: their width, pixels.
    """
    rows = {row["variant"]: row for row in report["sizes"][0]["variants"]}
    cells = [f"{rows[name]['fps']:.1f}" if name in rows else "-" for name in VARIANTS]
    fused = rows["fused"]
    agreement = psnr(folder / f"model-fused-{size}.ppm", folder / f"model-simple-{size}.ppm")
    return [*cells, f"{fused['useful_tflops']:.1f}", f"{100 * fused['useful_share']:.1f} %", f"{agreement:.1f}"]


def main() -> None:
    """Write the table, row after row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=Path, metavar="MODELS")
    parser.add_argument("--seconds", type=float, default=150)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table2.md"))
    options = parser.parse_args()
    card = gpu()
    page = Page(
        options.output,
        f"# Table 2: frames per second at {options.size} x {options.size}, CUDA",
        "",
        f"Printed by `python benchmarks/table2.py MODELS --seconds {options.seconds:g} --size {options.size}`.",
        "",
        f"GPU and driver: {card or NOT_RUN}. Host: {machine()}. Armadillo, {options.seconds:g} s of training a model. "
        "Medians of 200 frames by CUDA events. layered: cuBLAS, a product per layer over all pixels; one round: the "
        "paper's schedule, 20 steps of level 1 and 5 of each finer level, which leaves holes; the others go on until "
        "every ray is done. "
        "Useful TFLOP/s and share of the measured matrix peak, and PSNR against simple (float32): of fused. "
        "The paper's column: RTX 5090, its own renderer and networks.",
        "",
        "| model | paper | simple | fused | layered | layered, one round | TFLOP/s | of peak | PSNR, dB |",
        "| --- |" + " ---: |" * 8,
    )
    for title, name, (level, normal_level), printed in ROWS:
        path = options.models / f"{name}.safetensors"
        cells = [NOT_RUN] * 7
        if card is not None:
            train(path, MODELS_OF[name], options.seconds)
            built = build(load(path), options.models / name)
            report = built.benchmark(
                "--size", str(options.size), "--level", str(level), "--normal-level", str(normal_level)
            )
            cells = measured(report, built.program.parent, options.size)
        page.add(f"| {title} | {printed} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
