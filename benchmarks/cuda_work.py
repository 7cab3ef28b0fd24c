"""What a frame of the CUDA target has to compute, counted without a GPU; writes docs/results/cuda_work.md.

    python benchmarks/cuda_work.py MODELS [--seconds 150] [--size 512] [-o FILE]

MODELS and --seconds are those of benchmarks/table2.py, and so are the table's rows.
The rays are marched in numpy (codegen/reference/march.py).
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

from mplicits.codegen.ir.lower import lower
from mplicits.codegen.ir.program import Affine, Function, Program
from mplicits.codegen.reference.march import Rays, march
from mplicits.codegen.targets.cuda import WIDEST_SPLIT
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from protocol import Page, machine
from table2 import MODELS_OF, ROWS, train

SPLIT_COSTS = 3
"""Products of halves that `fused` makes for one product of level 1 where that is split into halves."""
BY_BLOCKS, FINISH = 1, 4
"""The rounds after which `fused` traces by blocks, and after which one kernel traces the rest (fused_frame.cuh)."""


@dataclass(frozen=True)
class Work:
    """Multiply-adds of one frame."""

    needed: float
    """Of the values and gradients that the frame needs."""
    fused: float
    """Of what the variant `fused` makes of that, without lanes that have no ray."""
    layered: float
    """Of the variant `layered`, until its last ray is done."""
    one_round: float
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
    return Work(trace + shading, trace + shading + rest, a_round * len(rays.traced) + everywhere, a_round + everywhere)


def _inner(program: Program, function: Function) -> int:
    """Return the multiply-adds of the products between a network's hidden layers, which the tensor cores make."""
    affines = [op for op in function.ops if isinstance(op, Affine)]
    return sum(int(program.constants[op.matrix].size) for op in affines[1:])


def main() -> None:
    """Write the table, row after row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=Path, metavar="MODELS")
    parser.add_argument("--seconds", type=float, default=150)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/cuda_work.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        f"# What a frame of {options.size} x {options.size} has to compute, CUDA",
        "",
        f"Printed by `python benchmarks/cuda_work.py MODELS --seconds {options.seconds:g} --size {options.size}`.",
        "",
        f"Counted, not timed, without a GPU: {machine()}. Armadillo, {options.seconds:g} s of training a model. "
        "Evaluations: of the networks, level by level. Rays left: after one round, from where `fused` traces "
        "by blocks, and after four, where one kernel takes the rest. Multiply-adds in thousand millions: of what "
        "the frame needs, gradients included; of what `fused` makes of that (halves where level 1 is split; lanes "
        "without a ray left out); of `layered`, until its last ray is done and in one round. The last two columns are "
        "the needed work of (256, 4) over this row's, and what 1,000 frames per second ask of the GPU.",
        "",
        "| model | evaluations, millions | steps, mean | most | rays | left | left | needed | fused | layered "
        "| one round | (256, 4) / this | TFLOP/s |",
        "| --- | ---: |" + " ---: |" * 11,
    )
    first = 0.0
    for title, name, (level, normal_level), _ in ROWS:
        path = options.models / f"{name}.safetensors"
        train(path, MODELS_OF[name], options.seconds)
        program = lower(load(path))
        eye, directions, footprint = Camera().rays(options.size, options.size)
        rays = march(program, eye, directions.reshape(-1, 3), level, footprint)
        frame = work(program, rays, level, normal_level)
        first = first or frame.needed
        traced = rays.steps[rays.steps > 0]
        left = [sum(rays.traced[k]) if k < len(rays.traced) else 0 for k in (BY_BLOCKS, FINISH)]
        evaluations = " + ".join(f"{count / 1e6:.2f}" for count in rays.evaluations)
        figures = (frame.needed, frame.fused, frame.layered, frame.one_round)
        page.add(
            f"| {title} | {evaluations} | {traced.mean():.1f} | {traced.max()} | {len(traced):,} | {left[0]:,} | "
            f"{left[1]:,} | {' | '.join(f'{figure / 1e9:,.0f}' for figure in figures)} | {first / frame.needed:.1f} | "
            f"{2 * frame.fused * 1e3 / 1e12:.0f} |"
        )


if __name__ == "__main__":
    main()
