"""Compares neural textures with UV-textured meshes (Section 4, Textures): writes docs/results/textures.md.

    PYTHONPATH=tests python benchmarks/textures.py [--shapes Spot,Bob] [--models FOLDER] [-o docs/results/textures.md]

--models FOLDER reads FOLDER/spot.safetensors and so on; missing models are trained and saved there.

The same cameras draw mesh (pyrender, four samples a pixel) and model (sphere tracing, one sample) unlit. The error is
the mean squared difference of pixels and channels, sRGB in [0, 1]. "inside" counts the mesh's pixels, where a miss of
the model is white; "whole" counts all pixels, on white.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.model import Model, shape_of
from mplicits.model.model_file import load, save
from mplicits.trainer import settings
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.openmp import prepare_openmp
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.train import Training
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context, open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.screenshot import save_png
from protocol import Page, machine
from support.pyrender_mesh import BACKGROUND, PyrenderMesh
from textured_shapes import SHAPES

SIDE, PICTURE = 512, 128
"""Pixels per side of compared pictures, and of pictures on the page."""
VIEWS = [Camera(azimuth=30 * i, elevation=(20, -15, 50)[i % 3]) for i in range(12)]
SHOWN = 6
"""Index of the view that the page shows."""


@dataclass(frozen=True)
class Recipe:
    """How a shape's model is trained, and the paper's error."""

    levels: str
    """As --levels of `mplicits train` takes them."""
    texture: str
    """As --texture-network takes it."""
    omega: float
    """Of the texture, as --omega takes it."""
    steps: str
    """As --steps takes them."""
    paper: float
    """The paper's mean squared error."""
    goal: float | None
    """The mean squared error to reach; None where the image is not the paper's."""


RECIPES = {
    "Spot": Recipe("64x1,64x2", "128x2", 50, "1500,2500,2500", 0.0329, 0.00329),
    "Bob": Recipe("64x1,64x2", "128x2", 50, "1500,2500,2500", 0.0434, 0.00434),
    "Bunny": Recipe("64x1,64x2", "128x2", 50, "1500,2500,2500", 0.0720, None),
    "Egg": Recipe("32x1,32x1", "128x2", 50, "1000,1000,2500", 0.0291, None),
    "Earth": Recipe("32x1,32x1", "256x2", 100, "1000,1000,2500", 0.0033, 0.00165),
}


@dataclass
class Errors:
    """How the pictures of a model differ from those of the mesh, over all views."""

    inside: float = 0.0
    """Mean squared error over the mesh's pixels."""
    whole: float = 0.0
    """Mean squared error over all pixels."""
    coarse: float = 0.0
    """Mean squared error of level 1 alone over the mesh's pixels."""
    both: int = 0
    """Number of pixels that mesh and model both cover."""
    either: int = 0
    """Number of pixels that mesh or model covers."""


def train(name: str, path: Path) -> Model:
    """Train a model by the shape's recipe; the seconds in its provenance count from reading the file."""
    recipe, began = RECIPES[name], time.perf_counter()
    networks = settings.networks(recipe.levels)
    chosen = Settings(
        networks,
        (*settings.omegas(None, networks), recipe.omega),
        settings.steps(recipe.steps, len(networks)),
        texture_network=settings.networks(recipe.texture)[0],
    )
    return Training(load_shape(str(path))[0], chosen, TrainingBar(False), began).run()


def trained(name: str, path: Path, folder: Path | None) -> Model:
    """Read the model from the folder, or train it and put it there, where there is a folder."""
    file = None if folder is None else folder / f"{name.lower()}.safetensors"
    if file is not None and file.exists():
        return load(file)
    model = train(name, path)
    if file is not None:
        save(model, file)
    return model


def compare(name: str, model: Model, path: Path, context: Context, folder: Path) -> Errors:
    """Compare the pictures of a model and of its mesh, the file `path`, from all views.

    For the view SHOWN, writes a picture into `folder`: the mesh, the model, its level 1, eight times the model's error.
    """
    renderer = Renderer(context, bake(model))
    reference = PyrenderMesh(trimesh.load_mesh(path, process=False), model.center, model.scale, (SIDE, SIDE))
    errors = Errors()
    for i, camera in enumerate(VIEWS):
        truth, depth = reference(camera)
        inside = depth > 0
        color, hit = draw(renderer, camera, None)
        coarse, _ = draw(renderer, camera, 1)
        error = (color - truth) ** 2
        errors.inside += float(error[inside].mean()) / len(VIEWS)
        errors.whole += float(error.mean()) / len(VIEWS)
        errors.coarse += float(((coarse - truth) ** 2)[inside].mean()) / len(VIEWS)
        errors.both += int((hit & inside).sum())
        errors.either += int((hit | inside).sum())
        if i == SHOWN:
            strip = np.concatenate((truth, color, coarse, 1 - np.minimum(8 * np.abs(color - truth), 1)), axis=1)
            small = strip.reshape(PICTURE, SIDE // PICTURE, -1, SIDE // PICTURE, 3).mean(axis=(1, 3))
            save_png(folder / f"textures-{name.lower()}.png", small.astype(np.float32))
    reference.release()
    renderer.release()
    return errors


def draw(renderer: Renderer, camera: Camera, level: int | None) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Draw the texture's colors, unlit, on the background of the mesh's pictures. level: None for all levels.

    Returns the colors (SIDE, SIDE, 3), sRGB, and whether the surface was hit, (SIDE, SIDE).
    """
    image = renderer.render((SIDE, SIDE), camera, RenderOptions(level=level, shade="texture"))
    hit = image[..., 3] > 0.5
    return np.where(hit[..., None], image[..., :3].astype(np.float64), BACKGROUND), hit


def main() -> None:
    """Write the page and the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default=",".join(RECIPES), metavar="NAME,..")
    parser.add_argument("--models", type=Path, metavar="FOLDER", help="models to compare, and where to put others")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/textures.md"))
    options = parser.parse_args()
    prepare_openmp()
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Neural textures against UV-textured meshes",
        "",
        f"Printed by `PYTHONPATH=tests python benchmarks/textures.py`. {machine()}; trained on "
        f"{torch.get_num_threads()} of the cores.",
        "",
        f"{len(VIEWS)} views, {SIDE} x {SIDE}, unlit. The mesh: pyrender, four samples a pixel. The model: sphere "
        "tracing, one sample. Mean squared error, sRGB in [0, 1]: inside, over the mesh's pixels; whole, over the "
        "picture, background white; level 1, inside, level 1 alone with the same texture. Outline IoU: pixels of both "
        "over pixels of either. The paper gives one number and does not say which. The images of Egg and Bunny are "
        "ours (`benchmarks/textured_shapes.py`), so these rows cannot be compared with the paper's.",
        "",
        "| shape | levels + texture | parameters | steps | seconds | inside | whole | level 1 | outline IoU | paper | "
        "goal |",
        "| --- | --- |" + " ---: |" * 9,
    )
    context = open_osmesa()
    names = options.shapes.split(",")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            path, recipe = SHAPES[name](Path(folder)), RECIPES[name]
            model = trained(name, path, options.models)
            assert model.texture is not None
            errors = compare(name, model, path, context, options.output.parent)
            levels, provenance = ",".join(shape_of(level.network) for level in model.levels), model.provenance
            steps = ",".join(str(record["steps"]) for record in (*provenance["levels"], provenance["texture"]))
            goal = "" if recipe.goal is None else f"{recipe.goal:.5f}"
            page.add(
                f"| {name} | {levels} + {shape_of(model.texture)} | {model.parameters():,} | {steps} | "
                f"{provenance['seconds']:.0f} | {errors.inside:.5f} | {errors.whole:.5f} | {errors.coarse:.5f} | "
                f"{errors.both / errors.either:.4f} | {recipe.paper:.4f} | {goal} |"
            )
    page.add(
        "",
        "From left to right: the mesh, the model, its level 1, eight times the error (white: none).",
        "",
        *(f"![{name}](textures-{name.lower()}.png)\n" for name in names),
    )


if __name__ == "__main__":
    main()
