"""Measures a motion from one mesh to another: writes docs/results/motion.md.

    python benchmarks/motion.py MODEL A.obj B.obj --static A.safetensors B.safetensors [-o docs/results/motion.md]

MODEL is the result of `morph A.obj B.obj`; the static models are trained on A and on B. The first rows are the surfaces
in between, by the blend of both distances and by arrival times (trainer/shapes/morph.py). The last row is the model.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from mplicits.field.interpret import field_gradient, nested_field
from mplicits.ir.lower import lower
from mplicits.mesher.at_time import place_at
from mplicits.mesher.extract import extract_model
from mplicits.mesher.metrics import SampledSurface, chamfer
from mplicits.mesher.surface import Mesh
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.model.model import Model, shape_of
from mplicits.model.model_file import load
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.morph import Morph, blend, distances, morph, triangles
from protocol import Page, machine

FRAMES = 60
"""Steps in time."""
RESOLUTION, FINE = 80, 192
"""Grids of the frames' surfaces, and of surfaces whose Chamfer distances are measured."""
SAMPLES = 100_000
"""Points of each surface, for Chamfer distances."""
BAND_POINTS = 40_000
"""Points, at random times, for |grad f|."""


def follow(surface_at: Callable[[float], Mesh]) -> tuple[list[float], list[int]]:
    """Follow a surface through time. Returns Hausdorff distances of successive frames, and each frame's components."""
    apart, pieces = [], []
    before: tuple[Mesh, cKDTree] | None = None
    for k in range(FRAMES + 1):
        mesh = surface_at(k / FRAMES)
        tree = cKDTree(mesh.vertices)
        pieces.append(mesh.components()[0])
        if before is not None:
            there, back = tree.query(before[0].vertices)[0], before[1].query(mesh.vertices)[0]
            apart.append(float(max(np.max(there), np.max(back))))
        before = mesh, tree
    return apart, pieces


def row(name: str, apart: list[float], pieces: list[int]) -> str:
    """Write a row of the table of motions."""
    middle = float(np.median(apart))
    loose = sum(count > 1 for count in pieces)
    return f"| {name} | {middle:.4f} | {max(apart):.4f} | {max(apart) / middle:.1f} | {loose} | {max(pieces)} |"


def surface_of(change: Morph, time: float) -> Mesh:
    """Extract the surface between two shapes at a time."""
    vertices, faces, _ = triangles(change.field(time))
    return Mesh(vertices.astype(np.float32), faces)


def slopes(model: Model) -> tuple[float, float, float, float]:
    """Measure |grad f| in space in the last level's band: its 1st, 50th and 99th percentile, the share in 0.5..1.5."""
    rng, program, count = np.random.default_rng(0), lower(model), len(model.levels)
    delta = model.levels[max(0, count - 2)].delta
    found: list[np.ndarray] = []
    for time in rng.random(40):
        mesh = extract_model(model, RESOLUTION, time=float(time)).mesh
        at = mesh.vertices[rng.integers(len(mesh.vertices), size=BAND_POINTS // 40)]
        at = (at + rng.uniform(-delta, delta, at.shape)).astype(np.float32)
        _, reached = nested_field(program, at, count, float(time))
        gradient, _ = field_gradient(program, at[reached == count], count, float(time))
        found.append(np.linalg.norm(gradient, axis=1))
    lengths = np.concatenate(found)
    low, middle, high = np.quantile(lengths, (0.01, 0.5, 0.99))
    return float(low), float(middle), float(high), float(((lengths > 0.5) & (lengths < 1.5)).mean())


def error(model: Model, truth_path: Path, time: float) -> tuple[float, float]:
    """Return the squared-L2 Chamfer distance of a model's surface to a mesh, and that of two samplings of the mesh."""
    rng = np.random.default_rng(0)
    truth = SampledSurface(in_model_space(read_mesh(truth_path), *place_at(model, time)))
    ours = SampledSurface(extract_model(model, FINE, time=time).mesh)
    first, again = (truth.sample(SAMPLES, rng)[0] for _ in range(2))
    return chamfer(ours.sample(SAMPLES, rng)[0], first), chamfer(again, first)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("meshes", type=Path, nargs=2)
    parser.add_argument("--static", type=Path, nargs=2, required=True)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/motion.md"))
    options = parser.parse_args()
    model = load(options.model)
    first, second = options.meshes
    page = Page(
        options.output,
        "# Motion",
        "",
        "Printed by `python benchmarks/motion.py MODEL A.obj B.obj --static A.safetensors B.safetensors`.",
        "",
        machine(),
        "",
        f"`{first.name}` becomes `{second.name}`. A frame is 1/{FRAMES} of the time; Hausdorff distances lie between "
        f"the vertices of successive frames' surfaces, in radii of the unit sphere (grid of "
        f"{RESOLUTION}^3 for the model); components count cavities too.",
        "",
        "| surface | Hausdorff, median | largest | largest / median | frames of more than one component "
        "| most components |",
        "| --- |" + " ---: |" * 5,
    )
    grids = [distances(load_shape(str(path), crease=CREASE)[0]) for path in options.meshes]
    linear, steady = blend(*grids), morph(*grids)
    page.add(row("blend of the distances", *follow(lambda time: surface_of(linear, time))))
    page.add(row("arrival times, which `morph` trains on", *follow(lambda time: surface_of(steady, time))))
    sizes = ",".join(shape_of(level.network) for level in model.levels)
    apart, pieces = follow(lambda time: extract_model(model, RESOLUTION, cull=True, time=time).mesh)
    page.add(
        row(f"the model, {sizes}", apart, pieces),
        "",
        f"The model has {model.parameters():,} parameters and took {model.provenance['seconds']:.0f} s.",
        "",
        "| end | static, parameters | Chamfer x 1e6, floor | static | the motion | ratio |",
        "| --- |" + " ---: |" * 5,
    )
    for time, mesh, path in zip((0.0, 1.0), options.meshes, options.static, strict=True):
        static = load(path)
        alone, floor = error(static, mesh, 0.0)
        moving, _ = error(model, mesh, time)
        page.add(
            f"| t = {time:g}, {mesh.name} | {static.parameters():,} | {floor * 1e6:.2f} | {alone * 1e6:.2f} | "
            f"{moving * 1e6:.2f} | {moving / alone:.2f} |"
        )
    low, middle, high, share = slopes(model)
    page.add(
        "",
        f"|grad f| in space, in the last level's band at 40 random times: {low:.2f}, {middle:.2f}, {high:.2f} (1st, "
        f"50th and 99th percentile); within 0.5 to 1.5 at {share:.2%} of the points.",
    )


if __name__ == "__main__":
    main()
