"""The GLSL shader on a GPU beside CUDA: literal and texture storage, widths 32 to 256; writes docs/results/glsl_gpu.md.

    python benchmarks/glsl_gpu.py [--size 512] [-o FILE]

The shader is drawn headless, by EGL. The models are SIRENs of size (width, 1) with random hidden weights, each fitted
to the same ball: the time of a frame depends on the steps that rays take, which are then the same in every column.
Compiling is the time from the shader's text to the first pixel, or that of nvcc. Without a GPU the cells say so.
"""

import argparse
import statistics
import tempfile
from pathlib import Path

import numpy as np

from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.errors import UserError
from mplicits.model.model import Layer, Level, Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from nvcc import NOT_RUN, build, gpu
from protocol import Page, machine

WIDTHS = (32, 64, 128, 256)
FRAMES = 200


def ball(width: int) -> Model:
    """Make a network of size (width, 1) that is roughly the distance to a ball of radius 0.7.

    Its hidden layers are random; the output row is the least-squares solution.
    """
    rng = np.random.default_rng(width)
    points = rng.uniform(-1, 1, (20_000, 3))
    first, shift = rng.normal(0, 2, (width, 3)), rng.uniform(-np.pi, np.pi, width)
    second, offset = rng.normal(0, 1 / np.sqrt(width), (width, width)), rng.uniform(-np.pi, np.pi, width)
    features = np.sin(np.sin(points @ first.T + shift) @ second.T + offset)
    features = np.concatenate([features, np.ones((len(points), 1))], axis=1)
    distance = np.linalg.norm(points, axis=1) - 0.7
    row = np.linalg.solve(features.T @ features + 1e-3 * np.eye(width + 1), features.T @ distance)
    pairs = ((first, shift), (second, offset), (row[None, :-1], row[-1:]))
    layers = tuple(Layer(weight.astype(np.float32), bias.astype(np.float32)) for weight, bias in pairs)
    return Model(f"ball {width}", (Level(layers, 0.1, 20),))


def glsl(model: Model, storage: str, size: int) -> tuple[str, str]:
    """Time the shader of `model`, and return two cells: frames per second and seconds of compiling."""
    context = open_context("egl")
    try:
        if context.software:
            return NOT_RUN, NOT_RUN
        renderer = Renderer(context, bake(model, storage, passes=True))
        seconds = [renderer.timed((size, size), Camera(), RenderOptions())[0] for _ in range(FRAMES // 10 + FRAMES)]
        compiling = renderer.compile_seconds
        renderer.release()
    except UserError as error:
        return f"refused: {error}", "-"
    finally:
        context.release()
    return f"{1 / statistics.median(seconds[-FRAMES:]):.0f}", f"{compiling:.2f}"


def cuda(model: Model, size: int) -> list[str]:
    """Time the CUDA program of `model`.

    Returns three cells: frames per second of simple and of fused, and seconds of nvcc.
    """
    if gpu() is None:
        return [NOT_RUN] * 3
    with tempfile.TemporaryDirectory() as folder:
        built = build(model, Path(folder))
        rates = [
            built.benchmark("--size", str(size), "--variant", variant)["sizes"][0]["variants"][0]["fps"]
            for variant in ("simple", "fused")
        ]
    return [*(f"{rate:.0f}" for rate in rates), f"{built.seconds:.1f}"]


def main() -> None:
    """Write the table, row after row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/glsl_gpu.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        f"# GLSL on a GPU, beside CUDA, {options.size} x {options.size}",
        "",
        f"Printed by `python benchmarks/glsl_gpu.py --size {options.size}`.",
        "",
        f"GPU and driver: {gpu() or NOT_RUN}. Host: {machine()}. Frames per second, medians of {FRAMES}; compiling in "
        "seconds.",
        "",
        "| network | literal | compiling | texture | compiling | CUDA simple | CUDA fused | nvcc |",
        "| --- |" + " ---: |" * 7,
    )
    for width in WIDTHS:
        model = ball(width)
        cells = [cell for storage in ("literal", "texture") for cell in glsl(model, storage, options.size)]
        page.add(f"| ({width}, 1) | {' | '.join([*cells, *cuda(model, options.size)])} |")


if __name__ == "__main__":
    main()
