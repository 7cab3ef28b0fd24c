"""Measures motions whose answer is known by a formula: writes docs/results/motion_known.md.

    python benchmarks/motion_known.py [--moments 17] [--levels 64x1,64x2] [--steps 1500,2500] [-o FILE]

A torus that turns and twists: its point p goes to turn(90 degrees t) twist(120 degrees t per unit of x) p. A ball that
splits: the surface |x - a|^2 |x + a|^2 = b^4 with a = 0.6 t along the x axis, two pieces once a > b. Each is written as
meshes of so many moments, which `train --time` takes; times half-way between moments are none that it has seen.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from skimage.measure import marching_cubes

import mplicits
from mplicits.mesher.distance import compare_field
from mplicits.mesher.evaluate import compare
from mplicits.mesher.extract import extract_model
from mplicits.mesher.surface import Mesh
from mplicits.model.model import Model
from mplicits.model.model_file import load
from protocol import Page, machine

Doubles = NDArray[np.float64]

RING, TUBE = 0.62, 0.2
"""Radii of the torus."""
TURN, TWIST = np.radians(90), np.radians(120)
"""Of the torus: in all, and from one side to the other for each unit of x."""
WAY, SIZE = 0.6, 0.45
"""Of the ball: a at time 1, and b."""
GRID, EXTENT = 128, 1.1
"""Cells along a side of the grid that the ball's surface is found on, and half its side."""
POLISH = 3
"""Newton's steps that bring the vertices of that surface onto the formula."""
RESOLUTION, SAMPLES, FIELD_SAMPLES = 192, 200_000, 20_000
SHOWN = 5
"""Moments, and times half-way between two, that are measured."""


def turned(points: Doubles, angle: Doubles | float) -> Doubles:
    """Turn points (N, 3) around the x axis."""
    x, y, z = points.T
    return np.stack([x, np.cos(angle) * y - np.sin(angle) * z, np.sin(angle) * y + np.cos(angle) * z], axis=1)


def torus(time: float) -> trimesh.Trimesh:
    """Make the torus at a time in [0, 1]."""
    mesh = trimesh.creation.torus(RING, TUBE, major_sections=256, minor_sections=96)
    points = np.asarray(mesh.vertices, np.float64)
    points = turned(points, TWIST * time * points[:, 0])
    angle = TURN * time
    x, y, z = points.T
    points = np.stack([np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x], axis=1)
    return trimesh.Trimesh(points, mesh.faces, process=False)


def ball(time: float) -> trimesh.Trimesh:
    """Make the ball, or the two that it has become, at a time in [0, 1]."""

    def value(points: Doubles) -> Doubles:
        shift = np.array([WAY * time, 0, 0])
        product = ((points - shift) ** 2).sum(axis=-1) * ((points + shift) ** 2).sum(axis=-1)
        return np.asarray(product - SIZE**4)

    axis = np.linspace(-EXTENT, EXTENT, GRID + 1)
    values = value(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1))
    vertices, faces, _, _ = marching_cubes(values, 0.0, spacing=(axis[1] - axis[0],) * 3)  # type: ignore[no-untyped-call]
    points = np.asarray(vertices - EXTENT, np.float64)
    for _ in range(POLISH):
        h = 1e-5
        slope = np.stack([(value(points + h * e) - value(points - h * e)) / (2 * h) for e in np.eye(3)], axis=1)
        steep = np.maximum((slope**2).sum(axis=1), 1e-4)  # none where the two parts touch
        points -= (value(points) / steep)[:, None] * slope
    mesh = trimesh.Trimesh(points, faces, process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def measure(page: Page, name: str, shape: Callable[[float], trimesh.Trimesh], options: argparse.Namespace) -> None:
    """Train a motion on its moments, and add the rows of what it is at these and between."""
    with tempfile.TemporaryDirectory() as folder:
        for k in range(options.moments):
            shape(k / (options.moments - 1)).export(Path(folder, f"{k:03}.ply"))
        path = Path(folder, "motion.safetensors")
        field = mplicits.train(folder, options.levels, time=True, steps=options.steps, texture="none", quiet=True)
        field.save(path)
        model = load(path)
    seconds = model.provenance["seconds"]
    for place in np.linspace(0, options.moments - 1.5, 2 * SHOWN - 1):
        at = round(2 * float(place)) / 2
        page.add(row(name, model, shape, at / (options.moments - 1), between=at % 1 > 0))
    page.add(f"| {name} | {seconds:.0f} s of training | | | | | | |")


def row(name: str, model: Model, shape: Callable[[float], trimesh.Trimesh], time: float, *, between: bool) -> str:
    """Compare the model with the formula's surface at a time."""
    truth = shape(time)
    vertices = (np.asarray(truth.vertices) - model.centre) / model.scale
    mesh = Mesh(vertices.astype(np.float32), np.asarray(truth.faces, np.int64))
    figures = compare(extract_model(model, RESOLUTION, time=time).mesh, mesh, SAMPLES)
    field = compare_field(model, mesh, FIELD_SAMPLES, time=time)
    band, ball_error = field.band_error, field.domain_error
    assert band is not None
    assert ball_error is not None
    return (
        f"| {name} | {time:.3f}, {'between' if between else 'a moment'} | {band:.1e} | {ball_error:.1e} "
        f"| {figures.missing_mean:.1e}, {figures.missing_99:.1e} | {figures.chamfer / figures.floor:.2f} "
        f"| {figures.hausdorff:.1e} | {figures.components} ({figures.truth_components}) |"
    )


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--moments", type=int, default=17, help="meshes of each motion (default 17)")
    parser.add_argument("--levels", default="64x1,64x2")
    parser.add_argument("--steps", default="1500,2500")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/motion_known.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Motions with a known answer",
        "",
        f"Printed by `python benchmarks/motion_known.py --moments {options.moments} --levels {options.levels} --steps "
        f"{options.steps}`, {machine()}.",
        "",
        f"`train --time` on {options.moments} meshes each of a torus that turns by 90 degrees and twists, and of a "
        "ball that splits into two; the formulas are in that script. Error of f: mean |f - d| in the last level's band "
        "and in the unit ball, against the distance to the formula's surface at that time. Surface: mean and 99th "
        "percentile of the distance of the true surface's points to the model's. Model units.",
        "",
        "| motion | time | error of f, band | in the ball | surface | Chamfer, of the floor | Hausdorff "
        "| components (truth) |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    )
    measure(page, "torus", torus, options)
    measure(page, "ball", ball, options)


if __name__ == "__main__":
    main()
