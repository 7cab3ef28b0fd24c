"""Photographs (Appendix F, Table 10): NeuS's network against ours; writes docs/results/table10.md.

    PYTHONPATH=tests python benchmarks/table10.py [--scan] [--seconds 150] [--shrink 4] [-o docs/results/table10.md]

Both train on the same rays, in the same order, with the same samples on a ray, for the same processor time. NeuS's
network has its own loss weights and schedule (5e-4, a warm-up, a cosine down to a twentieth), and in another row four
times the rate, since the run is short. Sets: DTU's scan 24, and Spot drawn by pyrender from 24 sides and 6 more.
Held-out views are volume rendered; PSNR is over the masks' pixels.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

from mplicits.capture.evaluation import render_view
from mplicits.capture.finish import model_of, unfinished_levels
from mplicits.capture.folder import read_photographs
from mplicits.capture.learner import Learner
from mplicits.capture.photographs import Photograph, Photographs, split
from mplicits.capture.rays import rays_of
from mplicits.capture.rendering import Effort, Scene
from mplicits.capture.scene import MultiscaleScene
from mplicits.mesher.extract import extract
from mplicits.mesher.grid import Grid
from mplicits.mesher.metrics import SampledSurface, chamfer
from mplicits.mesher.model_field import Field, ModelField
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.trainer.machine import prepare
from mplicits.trainer.shapes.shape import normalize
from neus import NeusScene
from photo_contenders import (
    DELTAS,
    LAYERS,
    NEUS_RATE,
    SEED,
    SKIP,
    STEPS,
    WIDTH,
    NeusField,
    NeusLearner,
    TwiceDifferentiated,
    cost_of_a_step,
    learn,
)
from protocol import DATA, Page, machine
from support.photographed import around, write_photographs

CPU = torch.device("cpu")
LEVELS = ((128, 4), (256, 5))
"""The paper's."""
OMEGAS = (15.0, 30.0)
LAST_DELTA = 0.02
"""Band half-width of the last level, where the mesh is culled."""
FACTOR = 4.0
"""On NeuS's rate, in its second row."""
SCAN_SIZE = (1600, 1200)
"""Picture size that the cameras of scan 24 refer to."""
RESOLUTION, SAMPLES = 64, 200_000
"""For Chamfer distances: cells per side of the meshes, and samples."""
PICTURE = 200
"""Smallest height of a picture on the page, pixels."""
HEAD = """# From photographs to a shape (Table 10)

Printed by `PYTHONPATH=tests python benchmarks/table10.py {options}`. {machine}.

NeuS's own network and ours train for the same processor time ({seconds:g} s, one thread) on the same rays: {rays} a
step, {samples} samples each. All widths are 1/{shrink} of the paper's: NeuS {width}x{layers} ({neus:,} parameters of
the distance), ours {levels} ({ours:,}); radiance networks {width} wide. PSNR: mean of {judged} held-out views, over the
masks. Chamfer: squared, {count:,} samples, in radii of the shape; the floor is {floor:.1e}.

With autograd differentiating twice, in place of the adjoint pass, a step of ours takes {cost:.2f} times the processor
time (median of {timed} steps).

| photographs | network | steps | PSNR, held out | ours to it | Chamfer |
|---|---|---:|---:|---:|---:|"""


@dataclass(frozen=True, eq=False)
class Set:
    """Photographs, and points of the true surface."""

    name: str
    file: str
    photographs: Photographs
    every: int
    truth: NDArray[np.float64] | None
    """Points of the true surface, model space."""


def judged(scene: Scene, views: list[Photograph], effort: Effort) -> tuple[float, NDArray[np.uint8]]:
    """Return the mean PSNR of held-out views, and the first picture (H, W, 3)."""
    found = [render_view(scene, view, effort, 0.0, CPU) for view in views]
    first = (255 * np.clip(found[0][0], 0, 1)).astype(np.uint8)
    return float(np.mean([psnr for _, psnr in found])), first


def write_beside(view: Photograph, shown: list[NDArray[np.uint8]], path: Path) -> None:
    """Write a photograph, black where its mask is, and pictures of the same view, side by side."""
    assert view.mask is not None
    row = Image.fromarray(np.concatenate([view.colors * view.mask[..., None].astype(np.uint8), *shown], axis=1))
    factor = -(-PICTURE // row.height)
    row.resize((factor * row.width, factor * row.height), Image.Resampling.NEAREST).save(path, optimize=True)


def distance_to(truth: NDArray[np.float64] | None, field: Field, *, cull: bool) -> str:
    """Write the Chamfer distance of a field's surface to points, for the table."""
    if truth is None:
        return "no truth"
    mesh = extract(field, RESOLUTION, cull=cull)
    if not len(mesh.faces):
        return "no surface"
    return f"{chamfer(SampledSurface(mesh).sample(SAMPLES, np.random.default_rng(1))[0], truth):.1e}"


def spot(folder: Path, size: int) -> tuple[Photographs, NDArray[np.float64], float]:
    """Draw Spot from 24 sides and 6 more, every fifth being one of these. Also return its samples and their floor."""
    sides = [*around(12, 15), *around(8, 50, 10), *around(4, -25, 20)]
    held = around(6, 30, 35)
    cameras = []
    for k, one in enumerate(held):
        cameras += [*sides[4 * k : 4 * k + 2], one, *sides[4 * k + 2 : 4 * k + 4]]
    file = DATA / "textured" / "spot.obj"
    write_photographs(folder, file, cameras, size)
    mesh = read_mesh(file)
    _, center, scale = normalize(np.asarray(mesh.vertices, np.float64))
    surface = SampledSurface(in_model_space(mesh, center, scale))
    rng = np.random.default_rng(0)
    points, again = (surface.sample(SAMPLES, rng)[0] for _ in range(2))
    return read_photographs(folder)[0], points, chamfer(points, again)


def main() -> None:
    """Run both sides on both sets, and write the page and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=150.0, help="processor time of each contender")
    parser.add_argument("--shrink", type=int, default=4, help="divides all widths")
    parser.add_argument("--rays", type=int, default=192, help="of a step")
    parser.add_argument("--size", type=int, default=100, help="pixels of a side of Spot's pictures")
    parser.add_argument("--judged", type=int, default=6, help="held-out views that are measured")
    parser.add_argument("--scan", action="store_true", help="scan 24 as well as Spot")
    parser.add_argument("--scale", type=float, default=0.25, help="of scan 24's 800 x 600 pictures")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table10.md"))
    args = parser.parse_args()
    torch.set_num_threads(1)
    prepare(CPU)
    folder = Path(tempfile.mkdtemp(prefix="mplicits-"))
    spots, truth, floor = spot(folder, args.size)
    sets = [Set("Spot", "spot", spots, 5, truth)]
    if args.scan:
        scan, _ = read_photographs(DATA / "dtu_scan24", args.scale, SCAN_SIZE)
        sets.append(Set("scan 24", "scan24", scan, 8, None))

    effort, width = Effort(), WIDTH // args.shrink
    levels = tuple((w // args.shrink, depth) for w, depth in LEVELS)
    sizes = levels, OMEGAS, DELTAS, width
    ours = sum(w.numel() for weights in MultiscaleScene(*sizes, CPU, SEED).levels for w in weights)
    rays, _ = rays_of(spots.views, CPU)
    twice, by_hand = (
        cost_of_a_step(kind(*sizes, CPU, SEED), rays, args.rays) for kind in (TwiceDifferentiated, MultiscaleScene)
    )
    page = Page(
        args.output,
        HEAD.format(
            seconds=args.seconds,
            rays=args.rays,
            samples=effort.even + effort.more,
            shrink=args.shrink,
            width=width,
            layers=LAYERS,
            neus=NeusScene(width, LAYERS, SKIP, width, SEED).size(),
            levels=" then ".join(f"{w}x{d}" for w, d in levels),
            ours=ours,
            count=SAMPLES,
            floor=floor,
            judged=args.judged,
            cost=twice / by_hand,
            timed=STEPS,
            machine=machine(),
            options=" ".join(sys.argv[1:]),
        ),
    )
    for case in sets:
        learnt, held = split(case.photographs, case.every)
        rays, _ = rays_of(learnt, CPU)
        label = f"{case.name}, {len(learnt)} + {len(held)} of {held[0].size[0]} x {held[0].size[1]}"
        held = held[: args.judged]
        scene = MultiscaleScene(*sizes, CPU, SEED)
        began = time.process_time()
        scene.become_sphere(SEED)
        learner = Learner(scene, rays, args.rays, 0.0, SEED)
        steps = learn(learner, args.seconds - (time.process_time() - began))
        gained, one = judged(scene, held, effort)
        shown = [one]
        measured = unfinished_levels(scene.weights(), [*DELTAS, LAST_DELTA])
        model = model_of(case.photographs, measured, None, {"settings": {"credit": ""}})
        distance = distance_to(case.truth, ModelField(model, Grid(RESOLUTION).diagonal), cull=True)
        page.add(f"| {label} | ours | {steps:,} | {gained:.2f} dB | | {distance} |")
        for name, factor in ((f"NeuS, {FACTOR:g} times the rate", FACTOR), ("NeuS", 1.0)):
            neus = NeusLearner(rays, args.rays, effort, width, factor * NEUS_RATE)
            steps = learn(neus, args.seconds)
            decibels, one = judged(neus.scene, held, effort)
            shown.append(one)
            distance = distance_to(case.truth, NeusField(neus.scene), cull=False)
            page.add(
                f"| {label} | {name} | {steps:,} | {decibels:.2f} dB | {gained / decibels - 1:+.1%} | {distance} |"
            )
        write_beside(held[0], shown, args.output.with_name(f"table10-{case.file}.png"))
    page.add(
        "",
        f"A held-out view of each: the photograph where its mask is, ours, NeuS with {FACTOR:g} times the rate, NeuS.",
        "",
        *(f"![{case.name}](table10-{case.file}.png)\n" for case in sets),
    )


if __name__ == "__main__":
    main()
