"""Train point clouds: meshes' vertices against the meshes, and the bunny's range scans; writes docs/results/clouds.md.

    python benchmarks/clouds.py [--shapes scans,armadillo,bunny,lucy] [--levels 64x1,64x2] [--steps 1000,2500]

vertices: the positions and normals of a mesh's vertices, the paper's input, and nothing else. scans: the bunny's ten
range scans (benchmarks/scans.py). Everything is compared with the mesh, in the model space of its own model.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

import scans
from contenders import training_settings
from mplicits.mesher.evaluate import compare
from mplicits.mesher.extract import extract_model
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.train import Training
from protocol import DATA, Page, machine

SCANS = Path("scans") / "stanford_bunny_scans.zip"
"""The range scans, in the data's folder."""
GOAL = 1.3
"""Largest Chamfer distance of a mesh's vertices, as a multiple of the mesh's own."""


CAMERAS = ("30,20", "150,20", "270,-40")
"""Views of the scans' model, the last one from below."""
SIDE = 256
"""Pixels of a view."""


def picture_of(page: Path) -> Path:
    """Name the picture of the scans' model beside the page."""
    return page.with_name(f"{page.stem}-bunny-scans.png")


def picture(model: Path, output: Path) -> None:
    """Draw a model with `mplicits render` from all cameras, side by side."""
    views = []
    for camera in CAMERAS:
        view = model.with_suffix(".png")
        asked = ["render", str(model), "-o", str(view), "--size", str(SIDE), f"--camera={camera}"]
        subprocess.run([sys.executable, "-m", "mplicits", *asked], check=True)
        views.append(np.asarray(Image.open(view).convert("RGB")))
    Image.fromarray(np.concatenate(views, axis=1)).save(output)


def train(path: Path, options: argparse.Namespace) -> Model:
    """Train a file as `mplicits train --texture none` does."""
    shape, _ = load_shape(str(path))
    asked = training_settings(options.levels, options.steps, seed=options.seed)
    return Training(shape, asked, TrainingBar(True)).run()


def row(
    name: str, path: Path, truth: Path, options: argparse.Namespace, page: Page, mesh: float | None
) -> tuple[Model, float]:
    """Train a file, compare it with the mesh `truth`, and add its row. Returns the model, and its Chamfer distance.

    mesh: the Chamfer distance that the mesh itself has reached, where it was trained.
    """
    model = train(path, options)
    if options.keep:
        save(model, options.keep / f"{name.replace(' ', '-')}.safetensors")
    surface = extract_model(model, options.resolution).mesh
    figures = compare(surface, in_model_space(read_mesh(truth), *model.place), options.samples)
    page.add(
        f"| {name} | {figures.chamfer:.2e} | {figures.chamfer / figures.floor:.2f} "
        f"| {'' if mesh is None else f'{figures.chamfer / mesh:.2f}'} | {figures.normal_angle:.1f} "
        f"| {figures.hausdorff:.1e} | {figures.components} | {'yes' if figures.watertight else 'no'} "
        f"| {model.provenance['seconds']:.0f} |"
    )
    return model, figures.chamfer


def rows(name: str, folder: Path, options: argparse.Namespace, page: Page) -> None:
    """Train a shape in all its forms, and add their rows. folder: for the clouds' files."""
    if name == "scans":
        points, normals = scans.cloud(options.data / SCANS)
        np.savez(folder / "scans.npz", points=points, normals=normals)
        model, _ = row("bunny scans", folder / "scans.npz", options.data / "meshes" / "bunny.ply", options, page, None)
        save(model, folder / "scans.safetensors")
        picture(folder / "scans.safetensors", picture_of(options.output))
        return
    path = options.data / "meshes" / f"{name}.ply"
    mesh = trimesh.load_mesh(path, process=False)
    np.savez(folder / f"{name}.npz", points=mesh.vertices, normals=mesh.vertex_normals)
    _, reached = row(f"{name} mesh", path, path, options, page, None)
    row(f"{name} vertices", folder / f"{name}.npz", path, options, page, reached)


def main() -> None:
    """Train all shapes, and write the page."""
    parser = argparse.ArgumentParser(description="point clouds against meshes")
    parser.add_argument("--shapes", default="scans,armadillo,bunny,lucy", metavar="NAME,..")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--steps", default="1000,2500", metavar="N,..")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=500_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save the models in")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/clouds.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Point clouds",
        "",
        f"Printed by `python benchmarks/clouds.py --shapes {options.shapes} --levels {options.levels} "
        f"--steps {options.steps} --resolution {options.resolution} --samples {options.samples}`.",
        "",
        "Vertices: positions and normals of a mesh's vertices, and nothing else; goal: at most "
        f"{GOAL} times the Chamfer distance of the mesh, trained with as many steps. Scans: the bunny's ten range "
        "scans, merged. Chamfer: squared L2, both directions summed, unit sphere, to the mesh. Floor: two samplings of "
        "the mesh.",
        "",
        f"{machine()}.",
        "",
        "| input | Chamfer | of the floor | of the mesh's | normals, degrees | Hausdorff | components | watertight "
        "| training, s |",
        "|---|---:|---:|---:|---:|---:|---:|---|---:|",
    )
    with tempfile.TemporaryDirectory() as folder:
        for name in options.shapes.split(","):
            rows(name, Path(folder), options, page)
    if "scans" in options.shapes.split(","):
        page.add("", f"![The model of the scans from two sides and from below]({picture_of(options.output).name})")


if __name__ == "__main__":
    main()
