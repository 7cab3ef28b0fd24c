"""Measure memory and time of training on meshes of millions of faces; writes docs/results/large_meshes.md.

    python benchmarks/large_meshes.py [--cases lucy:1,lucy:10,sphere:1000] [--steps 4000,10000] [--levels 64x1,64x2]
        [--data FOLDER] [-o FILE]

lucy:N is meshes/lucy.ply, each face of which is cut into N^2; sphere:N is a UV sphere of N slices and N stacks, whose
centre is equally far from all faces. Every case is `mplicits train` in a process of its own.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from mplicits.trainer.shapes.curved import cut_triangle
from protocol import DATA, Page, machine

Doubles = NDArray[np.float64]
Whole = NDArray[np.int64]
DECIMALS = 6
"""Places of a cut mesh that agree to so many digits, as shares of its extent, are one vertex."""


def cut(vertices: Doubles, faces: Whole, cuts: int) -> tuple[Doubles, Whole]:
    """Cut each face of a mesh into cuts^2 in its plane. vertices: (V, 3). faces: (F, 3)."""
    grid, small = cut_triangle(cuts)
    points = np.einsum("mk,fki->fmi", grid, vertices[faces], optimize=True).reshape(-1, 3)
    keys = np.round(points / np.ptp(vertices, axis=0).max() * 10**DECIMALS).astype(np.int64)
    keys = keys - keys.min(axis=0)
    side = int(keys.max()) + 1
    _, first, inverse = np.unique((keys[:, 0] * side + keys[:, 1]) * side + keys[:, 2], True, True)
    facets = (small[None] + len(grid) * np.arange(len(faces))[:, None, None]).reshape(-1, 3)
    return points[first], inverse.reshape(-1)[facets]


def sphere(slices: int, stacks: int) -> tuple[Doubles, Whole]:
    """Make a UV sphere of radius 1 around the origin."""
    theta = np.linspace(0, np.pi, stacks + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, slices, endpoint=False)[None]
    rings = np.stack(np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), 2)
    vertices = np.concatenate((rings.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]))
    at = np.arange((stacks - 1) * slices).reshape(stacks - 1, slices)
    a, b, c, d = at[:-1], np.roll(at[:-1], -1, axis=1), at[1:], np.roll(at[1:], -1, axis=1)
    top, bottom = np.full(slices, at.size), np.full(slices, at.size + 1)
    parts = [(a, c, b), (b, c, d), (at[0], np.roll(at[0], -1), top), (np.roll(at[-1], -1), at[-1], bottom)]
    return vertices, np.concatenate([np.stack(part, axis=-1).reshape(-1, 3) for part in parts])


def write(case: str, data: Path, folder: Path) -> tuple[Path, int]:
    """Write the mesh of a case into a folder. Returns its file, and the number of its faces."""
    kind, _, size = case.partition(":")
    if kind == "lucy":
        lucy = trimesh.load_mesh(data / "meshes" / "lucy.ply", process=False)
        vertices, faces = cut(np.asarray(lucy.vertices), np.asarray(lucy.faces, np.int64), int(size))
    else:
        vertices, faces = sphere(int(size), int(size))
    path = folder / f"{kind}{size}.ply"
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path, len(faces)


def train_command(shape: str, levels: str, length: list[str], output: Path) -> list[str]:
    """Write the command of a training on the CPU. length: the options for its steps or seconds."""
    chosen = [shape, "--levels", levels, *length, "--texture", "none", "--device", "cpu", "--quiet", "-o", str(output)]
    return [sys.executable, "-m", "mplicits", "train", *chosen]


def measured(command: list[str]) -> tuple[float, float, float]:
    """Run a command. Returns seconds by the clock, seconds of the processor, and the most gigabytes resident."""
    began = time.perf_counter()
    child = subprocess.Popen(command)
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)}: status {status}")
    return time.perf_counter() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 / 1e9


def main() -> None:
    """Train every case, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", default="lucy:1,lucy:10,sphere:1000", metavar="KIND:N,..")
    parser.add_argument("--levels", default="64x1,64x2,64x2", metavar="NxD,..")
    parser.add_argument("--steps", default="4000,10000", metavar="N,..")
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/large_meshes.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Meshes of millions of faces",
        "",
        f"Printed by `python benchmarks/large_meshes.py --cases {options.cases} --levels {options.levels} "
        f"--steps {options.steps}`: `mplicits train` in a process of its own, from its start to the saved model. "
        "lucy:N is Lucy, each face cut into N^2; sphere:N a UV sphere of N x N.",
        "",
        f"{machine()}, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}.",
        "",
        "| mesh | faces | seconds by the clock | seconds of the processor | most memory resident, GB |",
        "| --- | ---: | ---: | ---: | ---: |",
    )
    for case in options.cases.split(","):
        with tempfile.TemporaryDirectory() as folder:
            path, faces = write(case, options.data, Path(folder))
            output = Path(folder) / "m.safetensors"
            command = train_command(str(path), options.levels, ["--steps", options.steps], output)
            clock, processor, memory = measured(command)
        page.add(f"| {case} | {faces:,} | {clock:.0f} | {processor:.0f} | {memory:.2f} |")


if __name__ == "__main__":
    main()
