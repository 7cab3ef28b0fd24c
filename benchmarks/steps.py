"""Counts the pixels that sphere tracing loses with a model's own bounds of its steps: writes docs/results/steps.md.

    python benchmarks/steps.py armadillo.safetensors lucy.ply ... [--side 512] [--views 2] [--steps 300,900] [-o FILE]

A model file is drawn as it is; a mesh is trained first, by --levels and --steps, into the folder that --keep names.
Every model is drawn with steps of 0.8 of the field's value and with the bounds in its file. The rays on which the two
differ, and all rays near a silhouette, are marched densely (tests/oracles/dense.py).
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion

from contenders import training_settings
from dense_view import Picture, lost_and_extra, views
from mplicits.codegen.targets.glsl330 import bake
from mplicits.ir.lower import lower
from mplicits.ir.program import Program
from mplicits.model.model import DEFAULT_STEP_BOUND, Model
from mplicits.model.model_file import load, save
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.train import Training
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march
from protocol import Page, machine

NEAR = 3
"""Pixels from a silhouette up to which every ray is marched densely."""
APART = 0.01
"""Distance along a ray by which two hits are of different parts of the shape, model units."""


@dataclass
class Count:
    """What one way of tracing does, all views together; numbers are of rays."""

    lost: int = 0
    """Rays that miss, or hit something behind, what dense marching meets."""
    extra: int = 0
    """Rays that hit although dense marching passes at over STOP pixels."""
    steps: int = 0
    """Steps of all rays."""
    rays: int = 0
    """Rays that make any step."""


def fixed(model: Model) -> Model:
    """Return a model whose steps are DEFAULT_STEP_BOUND of the field's value, at every level."""
    old = [replace(level, step_bound=DEFAULT_STEP_BOUND, band_step_bound=DEFAULT_STEP_BOUND) for level in model.levels]
    return replace(model, levels=tuple(old))


def doubtful(pictures: list[Picture]) -> NDArray[np.bool_]:
    """Find the rays (side, side) near a silhouette, and those that the pictures do not agree on."""
    hits = [picture[..., 3] > 0.5 for picture in pictures]
    distances = np.stack([np.where(hit, picture[..., 0], np.inf) for hit, picture in zip(hits, pictures, strict=True)])
    everywhere = np.all(hits, axis=0)
    apart = np.zeros_like(everywhere)
    apart[everywhere] = np.ptp(distances[:, everywhere], axis=0) > APART
    differ = np.any(hits, axis=0) & ~everywhere
    covered = binary_dilation(np.any(hits, axis=0), iterations=NEAR)
    edge = covered & ~binary_erosion(everywhere, iterations=NEAR)
    return np.asarray(edge | apart | differ)


def count(program: Program, camera: Camera, pictures: list[Picture], counts: list[Count]) -> int:
    """Add what each picture of a view loses to its count. Returns the number of pixels that the last one hits."""
    side = len(pictures[0])
    where = doubtful(pictures)
    eye, directions, footprint = camera.rays(side, side)
    closest, end = dense_march(program, eye, directions[where], len(program.bands), footprint)
    for picture, total in zip(pictures, counts, strict=True):
        lost, extra = lost_and_extra(picture[where], closest, end + APART)
        steps = picture[..., 1]
        total.lost += lost
        total.extra += extra
        total.steps += int(steps.sum())
        total.rays += int((steps > 0).sum())
    return int((pictures[-1][..., 3] > 0.5).sum())


def measure(page: Page, model: Model, side: int, cameras: list[Camera]) -> None:
    """Add one row to the table. side: of a picture, in pixels."""
    program = lower(model)
    old, new = (Renderer(open_osmesa(), bake(kind)) for kind in (fixed(model), model))
    at_old, at_new = Count(), Count()
    options = RenderOptions(shade="data", schedule="plain")
    hits = 0
    for camera in cameras:
        pictures = [renderer.render((side, side), camera, options) for renderer in (old, new)]
        hits += count(program, camera, pictures, [at_old, at_new])
    old.release()
    new.release()
    bands = [f"{level.band_step_bound:.3g}" for level in model.levels[:-1]]
    mean_old, mean_new = (total.steps / max(1, total.rays) for total in (at_old, at_new))
    page.add(
        f"| {model.name} | {', '.join([*bands, f'{model.levels[-1].step_bound:.3g}'])} | {hits:,} "
        f"| {at_old.lost} | {at_new.lost} | {at_old.extra} | {at_new.extra} "
        f"| {mean_old:.2f} | {mean_new:.2f} | {mean_new / mean_old:.2f} |"
    )


def trained(path: Path, levels: str, steps: str, keep: Path) -> Model:
    """Train a model of a mesh, or load the one that an earlier run kept."""
    kept = keep / f"{path.stem}.safetensors"
    if kept.exists():
        return load(kept)
    shape, _ = load_shape(str(path))
    model = Training(shape, training_settings(levels, steps), TrainingBar(True)).run()
    keep.mkdir(parents=True, exist_ok=True)
    save(model, kept)
    return model


def main() -> None:
    """Write the table for the models and meshes that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=Path, nargs="+", metavar="M.safetensors|MESH")
    parser.add_argument("--side", type=int, default=512, help="pixels per side (default 512)")
    parser.add_argument("--views", type=int, default=2, help="cameras around the shape (default 2)")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..", help="of models that are trained")
    parser.add_argument("--steps", default="300,900", metavar="N,..", help="of models that are trained")
    parser.add_argument("--keep", type=Path, default=Path("out/steps"), help="folder for models that are trained")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/steps.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Whole steps",
        "",
        f"Printed by `python benchmarks/steps.py {' '.join(path.name for path in options.models)}`, "
        f"{machine()}. {options.views} views of {options.side} x {options.side} by OSMesa, all levels.",
        "",
        f"Bounds: factors on the steps towards each band and towards the surface, measured by training; the other way "
        f"to trace is the factor {DEFAULT_STEP_BOUND} at every level, which files without bounds have. Lost: dense "
        "marching meets a part of the shape that tracing misses or sees another part behind. Extra: tracing hits, and "
        f"the ray passes at over 1/20 pixel. Dense marching checks the rays within {NEAR} pixels of a silhouette, and "
        "those on which the two ways of tracing differ.",
        "",
        "| model | bounds | pixels hit | lost: 0.8 | bounds | extra: 0.8 | bounds | steps per ray: 0.8 | bounds "
        "| ratio |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    )
    for path in options.models:
        is_model = path.suffix == ".safetensors"
        model = load(path) if is_model else trained(path, options.levels, options.steps, options.keep)
        measure(page, model, options.side, views(options.views))


if __name__ == "__main__":
    main()
