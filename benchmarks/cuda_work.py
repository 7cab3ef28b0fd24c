"""What a frame of the CUDA target has to compute, counted without a GPU; writes docs/results/cuda_work.md.

    python benchmarks/cuda_work.py M ... [--table2 MODELS [--seconds 150]] [--size 512] [-o FILE]

MODELS and --seconds are those of benchmarks/table2.py, and so are the rows that --table2 puts before those of models M.
The rays are marched in numpy (field/march.py), by both schedules.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frames import APART
from frames import Work as Losses
from mplicits.codegen.targets.cuda_tables import WIDEST_SPLIT
from mplicits.codegen.targets.uniforms import SCHEDULES
from mplicits.field.cells import Cells
from mplicits.field.march import Rays, march
from mplicits.ir.lower import lower
from mplicits.ir.program import Affine, Function, Program
from mplicits.model.gallery import model_path
from mplicits.model.model import Model, shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from oracles.dense import dense_march
from protocol import Page, machine
from table2 import MODELS_OF, ROWS, train

Directions = NDArray[np.float64]
SPLIT_COSTS = 3
"""Products of halves that `fused` makes for one product of level 1 where that is split into halves."""
BY_BLOCKS, FINISH = 1, 4
"""The rounds after which `fused` traces by blocks, and after which one kernel traces the rest (fused_frame.cuh)."""


@dataclass(frozen=True)
class Work:
    """Multiply-adds of one frame."""

    needed: float
    """Of the values and gradients that the frame needs."""
    shading: float
    """Of the gradients, which are in all the others, too."""
    fused: float
    """Of what the variant `fused` makes of that, without lanes that have no ray."""
    layered: float | None
    """Of the variant `layered`, until its last ray is done; None where rays are not traced by its schedule."""
    one_round: float | None
    """Of `layered` with a single round."""


def work(program: Program, rays: Rays, level: int, normal_level: int) -> Work:
    """Count the multiply-adds of a frame whose rays were marched to the end.

    level: the level that was traced; normal_level: the one that gives the normals. `layered` evaluates every network up
    to that of the phase, at every pixel and every step.
    """
    costs = [program.cost(function).multiply_adds for function in program.values]
    trace = sum(count * cost for count, cost in zip(rays.evaluations, costs, strict=False))
    hits = int(rays.hit.sum())
    shading = 2 * hits * sum(costs[:normal_level])
    split = program.widest(program.values[0]) <= WIDEST_SPLIT
    exact = rays.evaluations[0] - (rays.evaluations_outside if level > 1 else 0)
    rest = (SPLIT_COSTS - 1) * exact * _inner(program, program.values[0]) if split else 0
    a_round = len(rays.t) * sum(
        program.bands[phase - 1].iterations * sum(costs[:phase]) for phase in range(1, level + 1)
    )
    everywhere = shading * len(rays.t) / max(1, hits)
    fused = trace + shading + rest
    if not rays.traced:
        return Work(trace + shading, shading, fused, None, None)
    return Work(trace + shading, shading, fused, a_round * len(rays.traced) + everywhere, a_round + everywhere)


def _inner(program: Program, function: Function) -> int:
    """Return the multiply-adds of the products between a network's hidden layers, which the tensor cores make."""
    affines = [op for op in function.ops if isinstance(op, Affine)]
    return sum(int(program.constants[op.matrix].size) for op in affines[1:])


def left_after(program: Program, rays: Rays, level: int, rounds: int) -> int:
    """Count the rays that are not done after some rounds."""
    if rays.traced:
        return sum(rays.traced[rounds]) if rounds < len(rays.traced) else 0
    return int((rays.steps > rounds * program.bands[level - 1].iterations).sum())


def losses(program: Program, marched: list[Rays], eye: Directions, directions: Directions, footprint: float) -> str:
    """Return how many rays each schedule loses, and hits too much: cells "plain, relaxed" of the table's last columns.

    Rays whose ends are apart are marched densely, as in benchmarks/frames.py. eye: (3,); directions: (N, 3).
    """
    hit, t = (np.stack([getattr(rays, name) for rays in marched]) for name in ("hit", "t"))
    apart = np.abs(t[0] - t[1]) > APART * footprint * t[0]
    differ = (hit[0] != hit[1]) | (hit[0] & apart)
    dense = dense_march(program, eye, directions[differ], len(program.bands), footprint)
    found = [Losses(), Losses()]
    for k, of_schedule in enumerate(found):
        picture = np.stack([t[k], t[k], t[k], hit[k]], axis=1)[differ].astype(np.float32)
        of_schedule.judge(program, eye, directions[differ], picture, dense, footprint)
    return " | ".join(", ".join(str(getattr(each, name)) for each in found) for name in ("lost", "extra"))


def rows(models: list[Path], table2: Path | None, seconds: float) -> Iterator[tuple[str, Model, int, int]]:
    """Yield the title, the model, the level that is traced and the level of the normals for each row."""
    for title, name, (level, normal_level), _ in ROWS if table2 else ():
        assert table2 is not None
        path = table2 / f"{name}.safetensors"
        train(path, MODELS_OF[name], "--seconds", f"{seconds:g}")
        yield title, load(path), level, normal_level
    for model in map(load, models):
        levels = " > ".join(shape_of(level.network) for level in model.levels)
        yield f"{model.name}, {levels}", model, len(model.levels), len(model.levels)


def main() -> None:
    """Write the table, row after row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=model_path, nargs="*", metavar="M")
    parser.add_argument("--table2", type=Path, metavar="MODELS")
    parser.add_argument("--seconds", type=float, default=150)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/cuda_work.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        f"# What a frame of {options.size} x {options.size} has to compute, CUDA",
        "",
        f"Printed by `benchmarks/cuda_work.py M ... --size {options.size}{' --table2 MODELS' * bool(options.table2)}`.",
        "",
        f"Counted, not timed, without a GPU: {machine()}. Rows named by widths: Armadillo, {options.seconds:g} s of "
        "training a model. Each has a line for the plain schedule and one for the relaxed, which is the default: with "
        "the grid of cells, where the last level is traced. Evaluations: of the networks, level by level. Steps: of "
        "the rays that make some, which are counted next to them. Left: after one round, from where `fused` traces "
        "by blocks, and after four, where one kernel takes the rest. Multiply-adds in thousand millions: of what "
        "the frame needs, gradients included; the gradients' own; of what `fused` makes of that (halves where level 1 "
        "is split; lanes without a ray left out); of `layered`, which has the plain schedule, until its last ray is "
        "done and in one round. Then what `fused` makes by the plain schedule over this line's, gradients left out, "
        "the needed work of the first row over this row's, and what 1,000 frames per second ask of the GPU. Lost, "
        "extra: rays that the plain schedule, or the relaxed one, loses or adds by dense marching, as in "
        "[frames.md](frames.md).",
        "",
        "| model | schedule | evaluations, millions | steps, mean | most | rays | left | left | needed | gradients "
        "| fused | layered | one round | plain / this | first / this | TFLOP/s | lost | extra |",
        "| --- | --- | ---: |" + " ---: |" * 15,
    )
    first: dict[str, float] = {}
    for title, model, level, normal_level in rows(options.models, options.table2, options.seconds):
        program = lower(model)
        last = level == len(program.bands)
        cells = Cells(program) if last else None
        eye, grid, footprint = Camera().rays(options.size, options.size)
        directions = grid.reshape(-1, 3)
        marched = [
            march(program, eye, directions, level, footprint, schedule=schedule, cells=cells) for schedule in SCHEDULES
        ]
        ends = losses(program, marched, eye, directions, footprint) if last else "- | -"
        plain = 0.0
        for schedule, rays in zip(SCHEDULES, marched, strict=True):
            frame = work(program, rays, level, normal_level)
            traced = frame.fused - frame.shading
            plain = plain or traced
            first.setdefault(schedule, frame.needed)
            stepped = rays.steps[rays.steps > 0]
            left = " | ".join(f"{left_after(program, rays, level, rounds):,}" for rounds in (BY_BLOCKS, FINISH))
            evaluations = " + ".join(f"{count / 1e6:.2f}" for count in rays.evaluations)
            figures = (frame.needed, frame.shading, frame.fused, frame.layered, frame.one_round)
            page.add(
                f"| {title} | {schedule} | {evaluations} | {stepped.mean():.1f} | {stepped.max()} | {len(stepped):,} "
                f"| {left} | {' | '.join('-' if figure is None else f'{figure / 1e9:,.1f}' for figure in figures)} "
                f"| {plain / traced:.2f} | {first[schedule] / frame.needed:.1f} "
                f"| {2 * frame.fused * 1e3 / 1e12:.0f} | {ends if schedule == SCHEDULES[-1] else ' | '} |"
            )


if __name__ == "__main__":
    main()
