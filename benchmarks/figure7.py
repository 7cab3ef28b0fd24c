"""Measures neural normal mapping (Figure 7): writes docs/results/figure7.md and its pictures.

    python benchmarks/figure7.py armadillo.safetensors lucy.safetensors --z-up lucy

The reference is the finest level's mesh by marching cubes, rasterized with its own normals, which are that level's
gradients at the vertices. The error (MSE) is the mean, over pixels and channels, of the squared difference of the sRGB
pictures, whose values lie in [0, 1].
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.mesher.extract import extract_model, up_to
from mplicits.model.files import show
from mplicits.model.model import Layer, Model, Network, shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context, open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.rasterizer import Rasterizer
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.screenshot import save_png
from mplicits.viewer.draw.triangles import Triangles
from protocol import Page, machine

Image = NDArray[np.float32]
"""A picture (H, W, 4), sRGB and alpha."""
PAPER = 0.00262, 0.00087
"""MSE that the paper's Figure 7 prints: of the coarse level, and with normal mapping."""
UPRIGHT = np.array(((1, 0, 0), (0, 0, -1), (0, 1, 0)), np.float32)
"""The map (3, 3) from a shape that stands along y to the same one along z; its columns are the images of the axes."""
PICTURED = {"level 1": "coarse", "level 1 + normals": "normal-mapped", "level 2 + normals": "one-more-level"}
"""Name of a row of traced levels -> the name of its picture."""


class Pictures:
    """Draws models from several cameras, as pictures of side x side pixels with `samples` rays per pixel."""

    def __init__(self, context: Context, side: int, cameras: list[Camera], samples: int) -> None:
        self._context, self._size, self._cameras = context, (side, side), cameras
        self._options = RenderOptions(samples=samples)

    def _from_all_cameras(self, renderer: Renderer, options: RenderOptions) -> list[Image]:
        return [renderer.render(self._size, camera, options) for camera in self._cameras]

    def of_mesh(self, model: Model, level: int, resolution: int, own: bool) -> list[Image]:
        """Rasterize a level's mesh by marching cubes, with its `own` normals or the last level's."""
        mesh = extract_model(up_to(model, level), resolution).mesh
        assert mesh.normals is not None
        triangles = Triangles(mesh.vertices, mesh.normals, mesh.faces.astype(np.int32))
        rasterizer = Rasterizer(self._context, model, triangles)
        images = self._from_all_cameras(rasterizer, replace(self._options, split_at=float(own)))
        rasterizer.release()
        return images

    def of_levels(self, model: Model, pairs: list[tuple[int, int]]) -> list[list[Image]]:
        """Trace levels with the normals of others: a list of pictures for each pair (level, normal level)."""
        renderer = Renderer(self._context, bake(model))
        images = [
            self._from_all_cameras(renderer, replace(self._options, level=level, normal_level=normal_level))
            for level, normal_level in pairs
        ]
        renderer.release()
        return images


def upright(model: Model) -> Model:
    """Turn the model of a shape that stands along z to stand along y, by turning the weights of its first layers."""

    def turned(network: Network) -> Network:
        return Layer(network[0].weight @ UPRIGHT, network[0].bias), *network[1:]

    return replace(model, levels=tuple(replace(level, network=turned(level.network)) for level in model.levels))


def errors(images: list[Image], truth: list[Image]) -> tuple[float, float, float]:
    """Return the MSE of three sets of pixels.

    The sets are: all pixels; pixels of the reference `truth`; pixels that both pictures cover fully.
    """
    squares = [((ours - theirs)[..., :3] ** 2).mean(axis=-1) for ours, theirs in zip(images, truth, strict=True)]

    def mean(is_in_set: Callable[[Image, Image], NDArray[np.bool_]]) -> float:
        pairs = zip(images, truth, strict=True)
        counted = [square[is_in_set(*pair)] for square, pair in zip(squares, pairs, strict=True)]
        return float(np.concatenate(counted).mean())

    return (
        mean(lambda ours, theirs: theirs[..., 3] >= 0),
        mean(lambda ours, theirs: theirs[..., 3] > 0),
        mean(lambda ours, theirs: (theirs[..., 3] == 1) & (ours[..., 3] == 1)),
    )


def measure(model: Model, pictures: Pictures, resolution: int, page: Page, stem: Path) -> None:
    """Add a model's rows to the page, and write its pictures as STEM-NAME.png.

    resolution: of marching cubes, cells per side.
    """
    last = len(model.levels)
    truth = pictures.of_mesh(model, last, resolution, own=True)
    pairs = [(1, 1), (1, last), (2, last)]
    drawn = dict(zip(PICTURED, pictures.of_levels(model, pairs), strict=True))
    drawn |= {
        "mesh of level 1": pictures.of_mesh(model, 1, resolution, own=True),
        "mesh of level 1 + normals": pictures.of_mesh(model, 1, resolution, own=False),
    }
    shapes, provenance = ", ".join(shape_of(level.network) for level in model.levels), model.provenance
    steps, omegas = (", ".join(f"{record[key]:g}" for record in provenance["levels"]) for key in ("steps", "omega"))
    page.add(
        "",
        f"## {stem.name.removeprefix('figure7-')}: levels {shapes}",
        "",
        f"{model.parameters():,} parameters, trained on {show(provenance['source']['file'])} for "
        f"{provenance['seconds']:.0f} s of a busy machine: {steps} steps, omega {omegas}.",
        "",
        "| | MSE, all pixels | x | of the reference | x | of both | x |",
        "| --- |" + " ---: |" * 6,
    )
    for name, images in drawn.items():
        coarse = errors(drawn["mesh of level 1" if name.startswith("mesh") else "level 1"], truth)
        cells = [f"{error:.5f} | {base / error:.1f}" for error, base in zip(errors(images, truth), coarse, strict=True)]
        page.add(f"| {name} | {' | '.join(cells)} |")
    pictured = {file: drawn[name][0] for name, file in PICTURED.items()} | {"reference": truth[0]}
    cells = []
    for name, image in pictured.items():
        path = stem.with_name(f"{stem.name}-{name}.png")
        save_png(path, image)
        cells.append(f"![{path.stem}]({path.name})")
    page.add("", f"| {' | '.join(PICTURED)} | mesh of level {last} |", "|" + " :---: |" * 4, f"| {' | '.join(cells)} |")


def main() -> None:
    """Write the page and the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", type=Path, nargs="+", metavar="M.safetensors")
    parser.add_argument("--resolution", type=int, default=512, metavar="N", help="of marching cubes")
    parser.add_argument("--side", type=int, default=512, metavar="PIXELS")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--z-up", default="", metavar="NAME,...", help="models of shapes that stand along z")
    parser.add_argument("--azimuths", default="210,300,30,120", metavar="DEGREES,...", help="the first is pictured")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/figure7.md"))
    options = parser.parse_args()
    cameras = [Camera(azimuth=float(azimuth)) for azimuth in options.azimuths.split(",")]
    names = " ".join(path.name for path in options.models)
    standing = f" --z-up {options.z_up}" if options.z_up else ""
    page = Page(
        options.output,
        "# Figure 7: neural normal mapping",
        "",
        f"Printed by `python benchmarks/figure7.py {names}{standing} --side {options.side}`. {machine()}.",
        "",
        f"{options.side} x {options.side}, {options.samples} samples a pixel, OSMesa, Phong; means over views from "
        f"azimuths {options.azimuths} degrees, {cameras[0].elevation:g} degrees above. The reference is the last "
        f"level's mesh (marching cubes at {options.resolution}^3) with its own normals. MSE: of sRGB in [0, 1]; over "
        "all pixels, over those that the reference covers, and over those that both cover. x: improvement over level "
        "1 with its own normals, or over its mesh.",
        "",
        f"The paper's Figure 7, with other networks: coarse {PAPER[0]}, normal-mapped {PAPER[1]}, a factor of "
        f"{PAPER[0] / PAPER[1]:.1f}; it does not say whether the background counts.",
    )
    context = open_osmesa()
    pictures = Pictures(context, options.side, cameras, options.samples)
    for path in options.models:
        model = upright(load(path)) if path.stem in options.z_up.split(",") else load(path)
        measure(model, pictures, options.resolution, page, options.output.with_name(f"figure7-{path.stem}"))


if __name__ == "__main__":
    main()
