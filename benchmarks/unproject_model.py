"""How well a depth map becomes a model (Appendix G.1): writes docs/results/unproject_model.md, and a picture.

    PYTHONPATH=tests python benchmarks/unproject_model.py [--size 256] [--steps 600,2000,1000] [-o FILE]

The depth maps of unproject.py go through `unproject --close` and `train`. Each pixel of the camera that took them is
traced, and where the model's surface is met, its distance to the mesh is measured, in shares of the object's size, and
its colour compared with the picture's. Beside the rows stands the gallery's model of the mesh itself, where there is
one.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

import mplicits
from mplicits.api.field import Field
from mplicits.model.gallery import names
from mplicits.trainer.shapes.shape import normalise
from mplicits.viewer.draw.camera import Camera
from protocol import DATA, Page, machine
from support.rasterised import Rasterised
from unproject import SHAPES, SIZE, WORSENED

Doubles = NDArray[np.float64]

BESIDE = 30
"""Degrees around the shape, from the camera to the second picture."""
COLOURS = 64
"""Of the sheet of pictures."""
PICTURE = 160
"""Side of a picture, pixels."""
LIGHT = (-0.5, 0.7, -1.0)
"""Direction to the light that untextured meshes are drawn in."""


def rays(camera: Camera, size: int) -> tuple[Doubles, Doubles]:
    """Return the eye (3,) and the directions (size, size, 3) through the pixels' centres, top row first."""
    eye, directions, _ = camera.rays(size, size)
    return np.asarray(eye, np.float64), np.asarray(directions, np.float64)


def row(
    name: str, label: str, field: Field, mesh: trimesh.Trimesh, camera: Camera, colours: Doubles, seen: Doubles
) -> str:
    """Compare what a camera sees of a model with the mesh and its picture: a row of the table.

    field: in input space that is the mesh's. colours: (H, W, 3) and seen: (H, W), whether the mesh is there, of the
    picture.
    """
    eye, directions = rays(camera, len(seen))
    hits = field.trace(eye, directions[seen > 0], space="input")
    over = field.trace(eye, directions[~(seen > 0)], space="input").hit.sum() / (seen > 0).sum()
    points = hits.points[hits.hit].astype(np.float64)
    square = igl.point_mesh_squared_distance(points, mesh.vertices, np.asarray(mesh.faces, np.int64))[0]
    error = 100 * np.sqrt(square) / SIZE
    missed = 1 - hits.hit.mean()
    found = ""
    if field.model.coloured:
        squared = (field.color(points, space="input") - colours[seen > 0][hits.hit]) ** 2
        found = f"{squared.mean():.1e}"
    errors = f"{error.mean():.3f} % | {np.percentile(error, 95):.3f} % | {np.percentile(error, 99):.2f} %"
    return f"| {name} | {label} | {missed:.2%} | {over:.2%} | {errors} | {found} |"


def lit(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a mesh without a texture in shades of grey, by how its normals turn to a light; others as they are."""
    if isinstance(mesh.visual, trimesh.visual.TextureVisuals):
        return mesh
    shade = 0.2 + 0.6 * np.clip(mesh.vertex_normals @ (np.array(LIGHT) / np.linalg.norm(LIGHT)), 0, 1)
    colours = np.round(255 * np.repeat(shade[:, None], 3, axis=1)).astype(np.uint8)
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=colours, process=False)


def pictures(field: Field, drawn: Rasterised, camera: Camera) -> Image.Image:
    """Draw the mesh and the model, from the camera and from BESIDE degrees beside it, in a row."""
    strip = Image.new("RGB", (4 * PICTURE, PICTURE), "white")
    for i, azimuth in enumerate((camera.azimuth, camera.azimuth + BESIDE)):
        view = Camera(azimuth, camera.elevation)
        truth = Image.fromarray((255 * drawn(view)[0]).astype(np.uint8))
        strip.paste(truth, (2 * i * PICTURE, 0))
        shade = "texture" if field.model.coloured else "phong"
        own = azimuth, camera.elevation, view.away / field.model.scale
        ours = field.render(size=PICTURE, camera=own, shade=shade, background="#ffffff")
        strip.paste(Image.fromarray(ours), ((2 * i + 1) * PICTURE, 0))
    return strip


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=int, default=256, help="pixels a side of the depth maps")
    parser.add_argument("--levels", default="64x1,64x2")
    parser.add_argument("--steps", default="600,2000,1000")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/unproject_model.md"))
    args = parser.parse_args()
    page = Page(
        args.output,
        "# From a depth map to a model",
        "",
        f"Printed by `PYTHONPATH=tests python benchmarks/unproject_model.py --size {args.size} --levels {args.levels} "
        f"--steps {args.steps}`, {machine()}.",
        "",
        f"Depth and colour are pyrender's, {args.size} x {args.size} pixels; what is done to the depths is said in "
        "[From a depth map to a cloud](unproject.md). The clouds were closed (`--close`) and trained. Missed: "
        "pixels of the shape whose rays miss the model. Over: pixels beside the shape whose rays meet the model, as a "
        "share of the shape's. Errors: distances from what the camera sees of the model to "
        "the mesh, in percent of the object's size. Colours: mean squared error against the picture, sRGB in [0, 1]. "
        "Mesh itself: the gallery's model of that mesh.",
        "",
        "| shape | depths | missed | over | mean | 95 % | 99 % | colours |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    )
    strips: list[NDArray[np.uint8]] = []
    for name, (file, camera) in SHAPES.items():
        mesh = trimesh.load_mesh(DATA / file, process=False)
        vertices, centre, scale = normalise(np.asarray(mesh.vertices, np.float64))
        drawn, large = (Rasterised(lit(mesh), centre, scale, (side, side)) for side in (args.size, PICTURE))
        colours, depth = drawn(camera)
        moved = trimesh.Trimesh(vertices, mesh.faces, process=False)
        seen = np.where(depth > 0, depth, np.nan)
        if name.lower() in names():
            own = mplicits.load(name.lower())
            page.add(row(name, "mesh itself", _in_model_space(own), moved, camera, colours, depth))
        for label, worsen in WORSENED.items():
            field = trained(worsen(seen, np.random.default_rng(0)), colours, mesh, camera, args)
            page.add(row(name, label, field, moved, camera, colours, depth))
            strips.append(np.asarray(pictures(field, large, camera)))
        drawn.release()
        large.release()
    sheet = Image.fromarray(np.concatenate(strips)).quantize(COLOURS)
    sheet.save(args.output.with_suffix(".png"), optimize=True)
    page.add(
        "",
        f"The mesh and the model from the camera, then both from {BESIDE} degrees beside it; the rows are those of the "
        f"table:\n\n![Mesh and model]({args.output.stem}.png)",
    )


def _in_model_space(field: Field) -> Field:
    """Return a field whose input space is its model space, as the mesh is here."""
    return Field(replace(field.model, centre=(0.0, 0.0, 0.0), scale=1.0))


def trained(depth: Doubles, colours: Doubles, mesh: trimesh.Trimesh, camera: Camera, args: argparse.Namespace) -> Field:
    """Make a model of a depth map and its picture, in the space that the camera is in."""
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder, "depth.npy"), np.nan_to_num(depth).astype(np.float32))
        Image.fromarray(np.round(255 * colours).astype(np.uint8)).save(Path(folder, "image.png"))
        painted = isinstance(mesh.visual, trimesh.visual.TextureVisuals)
        cloud = mplicits.unproject(
            Path(folder, "depth.npy"),
            image=Path(folder, "image.png") if painted else None,
            fov=camera.fov,
            close=True,
        )
    matrix = camera.matrix().astype(np.float64)
    turn = matrix[:3, :3].T
    points, normals = cloud.points @ turn + matrix[:3, 3], cloud.normals @ turn
    given = (points, normals) if cloud.colours is None else (points, normals, cloud.colours / 255)
    return mplicits.train(given, args.levels, steps=args.steps, quiet=True)


if __name__ == "__main__":
    main()
