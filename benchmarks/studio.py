"""Counts what the shading "studio" costs beside Phong: writes docs/results/studio.md.

    python benchmarks/studio.py spot armadillo.safetensors ... [--side 512] [--views 10] [-o FILE]

The multiply-adds of a frame are counted in numpy on every eighth pixel in each direction: of tracing
(field/march.py), gradients and colours for both, and of openness (field/studio.py) for the
studio.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dense_view import views
from mplicits.codegen.targets.shader import FIRST_LOOKS
from mplicits.codegen.targets.uniforms import default
from mplicits.field.cells import Cells
from mplicits.field.interpret import field_gradient
from mplicits.field.lowest import lowest_point
from mplicits.field.march import march
from mplicits.field.studio import BLOCK, between, openness
from mplicits.ir.lower import lower
from mplicits.ir.program import Program
from mplicits.model.gallery import model_path
from mplicits.model.model import shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from protocol import Page, machine

THIN = 8
"""Of the pixels, every so many in each direction are counted; the corner of a block of BLOCK each."""


def key_light(camera: Camera) -> NDArray[np.float64]:
    """Return the direction (3,) to the key light, model space, of a default light (glsl/key_light.glsl)."""
    x, y, z = np.array(default("light")) / np.linalg.norm(default("light"))
    right = camera.matrix()[:3, 0].astype(np.float64)
    toward = x * right + np.array((0, max(y, 0.35), 0)) + z * np.array((-right[2], 0, right[0]))
    return np.asarray(toward / np.linalg.norm(toward))


def look_at_floor(
    program: Program, eye: NDArray[np.float64], rays: NDArray[np.float64], light: NDArray[np.float64], ground: float
) -> tuple[NDArray[np.float64], int]:
    """Find how open the floor is where rays (..., 3) meet it, NaN where they do not, (..., 3); and the evaluations."""
    found = np.full(rays.shape, np.nan)
    floored = (rays[..., 1] < 0) & (eye[1] > ground)
    points = eye + ((ground - eye[1]) / rays[floored][:, 1])[:, None] * rays[floored]
    found[floored], evaluations = openness(
        program, points, np.tile((0.0, 1.0, 0.0), (len(points), 1)), light, ground, True
    )
    return found, evaluations


def count(program: Program, camera: Camera, side: int, cells: Cells, ground: float) -> tuple[float, ...]:
    """Count a view: pixels that hit, multiply-adds by Phong (without, with looks), level 1 for surface, floor, blocks.

    Blocks: for the floor in passes, which look at the corners of blocks first.
    """
    level = len(program.bands)
    eye, directions, footprint = camera.rays(side, side)
    rays = directions[::THIN, ::THIN].reshape(-1, 3)
    traced = march(program, eye, rays, level, footprint, schedule="relaxed", cells=cells)
    hit, costs = traced.hit, [program.cost(function).multiply_adds for function in program.values]
    shading = sum(program.cost(function).multiply_adds for function in program.gradients)
    shading += 0 if program.texture is None else program.cost(program.texture).multiply_adds
    phong = float(np.dot(traced.evaluations, costs)) + int(hit.sum()) * shading
    looked = march(program, eye, rays, level, footprint, schedule="relaxed", cells=cells, first_looks=FIRST_LOOKS)
    gradient = sum(program.cost(function).multiply_adds for function in program.gradients)
    phong_looked = float(np.dot(looked.evaluations, costs)) + looked.looks * gradient + int(looked.hit.sum()) * shading
    points = eye + traced.t[hit, None] * rays[hit]
    normals, _ = field_gradient(program, points.astype(np.float32), level)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    light = key_light(camera)
    _, of_surface = openness(program, points, normals.astype(np.float64), light, ground, False)
    _, of_floor = look_at_floor(program, eye, rays[~hit], light, ground)
    corners, of_corners = look_at_floor(program, eye, directions[::BLOCK, ::BLOCK], light, ground)
    every = slice(None, None, THIN // BLOCK), slice(1, None, THIN // BLOCK)
    around = np.stack([corners[row, column].reshape(-1, 3) for row in every for column in every], axis=1)
    _, alike = between(around, np.zeros((len(around), 2)))
    _, of_others = look_at_floor(program, eye, rays[~hit & ~alike], light, ground)
    return int(hit.sum()), phong, phong_looked, of_surface, of_floor, of_others + of_corners / THIN**2


def measure(page: Page, path: Path, side: int, cameras: list[Camera]) -> None:
    """Add the row of one model."""
    model = load(path)
    program = lower(model)
    cells, ground, first = Cells(program), lowest_point(program), program.cost(program.values[0]).multiply_adds
    rows = [count(program, camera, side, cells, ground) for camera in cameras]
    hits, phong, looked, surface, floor, blocks = (np.array(column, np.float64) for column in zip(*rows, strict=True))
    share = 1 + first * (surface + floor) / phong
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    page.add(
        f"| {model.name} | {levels} | {surface.sum() / hits.sum():.1f} | {floor.sum() / hits.sum():.1f} "
        f"| {blocks.sum() / hits.sum():.1f} "
        f"| {1 + first * (surface + floor).sum() / phong.sum():.2f} | {share.min():.2f} | {share.max():.2f} "
        f"| {1 + first * (surface + blocks).sum() / looked.sum():.2f} |"
    )


def main() -> None:
    """Write the table for the models that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=model_path, nargs="+", metavar="M")
    parser.add_argument("--side", type=int, default=512, help="pixels per side (default 512)")
    parser.add_argument("--views", type=int, default=10, help="cameras around the shape (default 10)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/studio.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# What the studio costs",
        "",
        f"Printed by `python benchmarks/studio.py {' '.join(path.stem for path in options.models)} "
        f"--side {options.side} --views {options.views}`, {machine()}.",
        "",
        f"{options.views} views of {options.side} x {options.side}, all levels, at elevations of 20, -25, 50 and 0 "
        f"degrees in turn, counted on every {THIN}th pixel in each direction. Evaluations of level 1 for each pixel "
        "that hits: for those pixels themselves, and for the floor around them, all of it, and in passes, which look "
        "at the corners of blocks first (glsl/floor.glsl). Studio over Phong: multiply-adds of a "
        "frame, which for both are those of tracing with the grid of cells, gradients and colours, of all views "
        "together and of the cheapest and the dearest one, which looks down on the floor. In passes, as the viewer "
        "and the page draw: with first looks (glsl/normals.glsl) and the floor in blocks, of all views.",
        "",
        "| model | levels | evaluations on the surface | on the floor | in passes | studio over Phong | least | most "
        "| in passes |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
    )
    for path in options.models:
        measure(page, path, options.side, views(options.views))


if __name__ == "__main__":
    main()
