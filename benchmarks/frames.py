"""Compares the schedules of sphere tracing by the work and the time of a frame: writes docs/results/frames.md.

    PYTHONPATH=tests python benchmarks/frames.py M ... [--side 512] [--drawn N] [--views 10] [--timed 2] [-o FILE]

Multiply-adds of tracing are counted in NumPy (tests/oracles/march.py) on every fourth pixel in each direction.
Gradients and colors at the end of a ray cost the same in all schedules and are not counted. OSMesa draws and times
whole pictures with both schedules, at once and in passes, in turn. Rays on which pictures differ are marched densely.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dense_view import STOP, Picture, along_surface, lost_and_extra, views
from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shader import NEWTON_STEPS
from mplicits.codegen.targets.shadertoy import WIDEST, exact
from mplicits.codegen.targets.shadertoy_text import savings, step_bound
from mplicits.field.cells import NEAR, NEAR_IN_FILE, Cells
from mplicits.field.half_widths import Grid
from mplicits.ir.lower import lower
from mplicits.ir.program import Program
from mplicits.model.gallery import model_path
from mplicits.model.model import Model, size_text
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march
from oracles.march import march
from oracles.short_march import STOP as SHORT_STOP
from oracles.short_march import short_march
from protocol import Page, machine

THIN = 4
"""Every N-th pixel in each direction is counted."""
APART = 0.25
"""Pixels along a ray: if the ends of two schedules are farther apart, dense marching checks the ray."""
BEHIND = 1.0
"""Pixels behind the end of dense marching: a hit farther behind is on another part of the shape."""
WAYS = ((0, "plain"), (1, "plain"), (1, "relaxed"))
"""How frames are drawn: at once (0) or in passes (1), by which schedule."""


@dataclass
class Work:
    """The work of tracing all views by one schedule."""

    multiply_adds: float = 0.0
    """Of the counted rays."""
    evaluations: NDArray[np.float64] = field(default_factory=lambda: np.zeros(1))
    """Of each level's network."""
    lost: int = 0
    """Rays that miss the surface that dense marching meets, or end behind it."""
    extra: int = 0
    """Rays that hit although dense marching passes at over STOP pixels."""
    stop: float = STOP
    """Pixels to the surface within which a ray may end."""
    hits: int = 0
    """Counted rays that hit."""

    def judge(
        self,
        program: Program,
        eye: NDArray[np.float64],
        directions: NDArray[np.float64],
        rays: NDArray[np.float32],
        dense: tuple[NDArray[np.float32], NDArray[np.float32]],
        footprint: float,
    ) -> None:
        """Count lost and extra rays. rays: (N, 4), of a Picture; dense: closest approach and end by dense marching."""
        closest, end = dense
        same = along_surface(program, eye, directions, (end, rays[:, 0]), footprint)
        lost, extra = lost_and_extra(rays, closest, np.where(same, np.inf, end * (1 + BEHIND * footprint)), self.stop)
        self.lost += lost
        self.extra += extra


Way = Callable[
    [NDArray[np.float64], NDArray[np.float64], float], tuple[NDArray[np.bool_], NDArray[np.float64], list[int], int]
]
"""Traces rays from a point, (3,), in directions (N, 3), with a pixel's width at distance 1: hit, t, evaluations,
gradients."""


def ways_of(program: Program, model: Model, cells: Cells) -> list[Way]:
    """Return the plain schedule, the relaxed one with a grid and with few cells, and Shadertoy's where there is one."""
    levels, alone = len(program.bands), bake(model)

    def marched(
        schedule: str, skipped: Cells | None, looks: int, narrow: tuple[Grid, ...] = (), near: float = NEAR
    ) -> Way:
        def way(eye: NDArray[np.float64], directions: NDArray[np.float64], footprint: float) -> Any:
            rays = march(program, eye, directions, levels, footprint, 64, 1.0, schedule, skipped, narrow, looks, near)
            return rays.hit, rays.t, rays.evaluations, rays.gradient_evaluations

        return way

    def short(eye: NDArray[np.float64], directions: NDArray[np.float64], footprint: float) -> Any:
        rays = short_march(
            program, eye, directions, footprint, step_bound(program), planes=saved.planes, narrow=saved.narrow
        )
        return rays.hit, rays.t, rays.evaluations, 0

    in_passes = marched("relaxed", cells, NEWTON_STEPS if model.scene is None else 0)
    found = [marched("plain", None, 0), in_passes, marched("relaxed", alone.few_cells, 0, alone.narrow, NEAR_IN_FILE)]
    if max(map(program.widest, program.functions())) > WIDEST:
        return found
    saved = savings(program, len(exact(model)))
    return [*found, short]


def count(program: Program, camera: Camera, side: int, ways: Sequence[Way], works: Sequence[Work]) -> None:
    """Add the work of tracing a view by each way, and its lost and extra rays.

    The ends of rays are compared with those of the first way; where they differ, dense marching decides.
    """
    eye, directions, footprint = camera.rays(side, side)
    rays = directions[::THIN, ::THIN].reshape(-1, 3)
    costs = np.array([program.cost(function).multiply_adds for function in program.values], np.float64)
    gradient = sum(program.cost(function).multiply_adds for function in program.gradients)
    ends = [way(eye, rays, footprint) for way in ways]
    for (hit, t, evaluations, looks), work in zip(ends, works, strict=True):
        work.evaluations = work.evaluations + np.asarray(evaluations, np.float64)
        work.multiply_adds += float(np.dot(evaluations, costs)) + looks * gradient
        work.hits += int(hit.sum())
        apart = hit & ends[0][0] & (np.abs(t - ends[0][1]) > APART * footprint * t)
        differ = (hit ^ ends[0][0]) | apart
        picture = np.stack([t, t, t, hit], axis=1)[differ].astype(np.float32)
        closest, end = dense_march(program, eye, rays[differ], len(program.bands), footprint)
        work.judge(program, eye, rays[differ], picture, (closest, end), footprint)


def judge(program: Program, camera: Camera, pictures: list[Picture], works: list[Work]) -> tuple[int, float]:
    """Count lost and extra rays of each schedule's picture, by dense marching of the rays on which pictures differ.

    Returns how many pixels the first picture hits, and the median distance between the ends of rays, in pixels.
    """
    side = len(pictures[0])
    eye, directions, footprint = camera.rays(side, side)
    hits = [picture[..., 3] > 0.5 for picture in pictures]
    both = hits[0] & hits[1]
    pixels = np.abs(pictures[0][..., 0] - pictures[1][..., 0]) / (footprint * np.maximum(pictures[0][..., 0], 1e-6))
    differ = (hits[0] ^ hits[1]) | (both & (pixels > APART))
    dense = dense_march(program, eye, directions[differ], len(program.bands), footprint)
    for picture, work in zip(pictures, works, strict=True):
        work.judge(program, eye, directions[differ], picture[differ], dense, footprint)
    return int(hits[0].sum()), float(np.median(pixels[both]))


def measure(page: Page, path: Path, side: int, cameras: list[Camera], timed: int, drawn_side: int) -> str:
    """Add the row of one model, and return its row of the table of drawn frames.

    side: of a picture, pixels; timed: how many cameras have frames drawn and timed, drawn_side pixels a side.
    """
    model = load(path)
    program = lower(model)
    began = time.process_time()
    cells = Cells(program)
    cells.grid()
    finding = time.process_time() - began
    ways = ways_of(program, model, cells)
    counted = [Work(stop=stop) for _, stop in zip(ways, (STOP, STOP, STOP, 1.05 * SHORT_STOP), strict=False)]
    shader = bake(model, passes=True)
    kinds = (replace(shader, passes=None), shader) if timed else ()
    renderers = [Renderer(open_osmesa(), kind) for kind in kinds]
    drawers = [(renderers[kind], schedule) for kind, schedule in WAYS if timed]
    seconds: list[list[float]] = [[] for _ in drawers]
    for drawn_by, schedule in drawers:
        drawn_by.timed((16, 16), cameras[0], RenderOptions(schedule=schedule))  # drivers compile again for a tile
    drawn = [Work(), Work()]
    hits, apart = 0, []
    for view, camera in enumerate(cameras):
        count(program, camera, side, ways, counted)
        if view >= timed:
            continue
        for (drawn_by, schedule), taken in zip(drawers, seconds, strict=True):
            began = time.process_time()
            drawn_by.timed((drawn_side, drawn_side), camera, RenderOptions(schedule=schedule))
            taken.append(time.process_time() - began)
        data = [RenderOptions(shade="data", schedule=schedule) for schedule in ("plain", "relaxed")]
        pictures = [renderers[1].render((drawn_side, drawn_side), camera, options) for options in data]
        covered, difference = judge(program, camera, pictures, drawn)
        hits += covered
        apart.append(difference)
    for renderer in renderers:
        renderer.release()
    levels = " > ".join(size_text(level.network) for level in model.levels)
    evaluations = [", ".join(f"{number / 1000:,.0f}" for number in work.evaluations) for work in counted[:2]]
    saved = [f"1 / {counted[0].multiply_adds / work.multiply_adds:.2f}" for work in counted[1:]]
    losses, extras = (", ".join(str(getattr(work, key)) for work in counted) for key in ("lost", "extra"))
    page.add(
        f"| {model.name} | {levels} | {evaluations[0]} | {evaluations[1]} | {saved[0]} | {saved[1]} "
        f"| {'-' if len(saved) < 3 else saved[2]} | {counted[0].hits:,} | {losses} | {extras} | {finding:.1f} |"
    )
    if not timed:
        return ""
    ratios = ([old / new for old, new in zip(seconds[0], taken, strict=True)] for taken in seconds[:0:-1])
    speeds = [f"{statistics.median(each):.2f}" for each in ratios]
    name = model.name if drawn_side == side else f"{model.name} ({drawn_side})"
    return (
        f"| {name} | {levels} | {speeds[0]} | {speeds[1]} | {hits:,} | {drawn[0].lost}, {drawn[1].lost} "
        f"| {drawn[0].extra}, {drawn[1].extra} | {max(apart):.3f} |"
    )


def main() -> None:
    """Write the table for the models that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=model_path, nargs="+", metavar="M")
    parser.add_argument("--side", type=int, default=512, help="pixels per side (default 512)")
    parser.add_argument("--views", type=int, default=10, help="cameras around the shape (default 10)")
    parser.add_argument("--timed", type=int, default=2, help="of these, drawn, timed, and marched densely (default 2)")
    parser.add_argument("--drawn", type=int, help="pixels per side of drawn and timed pictures (default: --side)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/frames.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# The work of a frame",
        "",
        f"Printed by `benchmarks/frames.py --side {options.side} --views {options.views} --timed {options.timed}`. "
        f"{machine()}.",
        "",
        f"{options.views} views of {options.side} x {options.side}, all levels. Evaluations: of each level's network, "
        f"in thousands, on every {THIN}th pixel in each direction. Multiply-adds: of tracing, as a fraction of the "
        "plain schedule's, without gradients and colors at the end of a ray.",
        "",
        "- Plain: steps as long as the free sphere. Relaxed: the default ([method](../method.md#fewer-evaluations)). "
        f"In one file: shaders that stand alone. Shadertoy: the steps of its text (networks up to {WIDEST} wide).",
        "- Lost rays miss a part of the shape, by dense marching; extra rays hit although they pass at over "
        f"{STOP:g} pixel. The four numbers are the four ways. Cells: seconds to find them.",
        "",
        "| model | levels | evaluations: plain | relaxed | multiply-adds | in one file | Shadertoy | rays hit | lost "
        "| extra | cells, s |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    )
    cameras, drawn_side = views(options.views), options.drawn or options.side
    drawn = [measure(page, path, options.side, cameras, options.timed, drawn_side) for path in options.models]
    if options.timed:
        page.add(
            "",
            "## Drawn",
            "",
            f"{options.timed} of the views, {drawn_side} x {drawn_side}. OSMesa, one sample, processor seconds. Times: "
            "frames per second of the relaxed schedule in passes, divided by those of the plain schedule in one draw.",
            "",
            "| model | levels | frames per second, times | plain, in passes | pixels hit | lost: plain, relaxed "
            "| extra | ends apart, median, pixels |",
            "|---|---|---:|---:|---:|---:|---:|---:|",
            *drawn,
        )


if __name__ == "__main__":
    main()
