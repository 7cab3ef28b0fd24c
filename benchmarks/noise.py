"""Compare ways to reconstruct a surface from a noisy oriented cloud; writes a page and pictures.

    python benchmarks/noise.py [--cases armadillo:0.01,armadillo:0.01:0.05,...] [--steps 700,2500]
        [--methods ours,uncleaned,siren,hash,poisson] [-o docs/results/noise.md]

A case is SHAPE:NOISE or SHAPE:NOISE:OUTLIERS, with a share of outliers, and with :bare or :uneven behind. A cloud is
100,000 points of a mesh in model space, uniform by area, with the normals of the faces. Noise is Gaussian, on each
coordinate of the points and, in the same size, of the normals; outliers are further points of the cube [-1, 1]^3 with
normals of any direction. bare: without normals, which are then estimated as `train` does. uneven: the density is ten
times as high at one end as at the other. ours: as `mplicits train CLOUD`. uncleaned: the same with `--noise 0`. siren:
one SIREN of as many parameters, hash: a hash grid, each on the cloud as it is, for the seconds that our training took.
poisson: screened Poisson (Kazhdan and Hoppe 2013) of pymeshlab, which has to be installed, by its defaults (depth 8).
"""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
from PIL import Image

from contenders import Trained, of_model, one_siren, training_settings
from hash_grid import hash_grid
from mplicits.mesher.evaluate import compare
from mplicits.mesher.extract import extract
from mplicits.mesher.grid import Grid
from mplicits.mesher.metrics import SampledSurface
from mplicits.mesher.surface import Mesh
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.orient import estimated_normals
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints, unit
from mplicits.trainer.train import Training
from protocol import DATA, Page, machine

POINTS = 100_000
"""Points of a cloud, without the outliers."""
CASES = ",".join(
    f"{shape}:{case}"
    for case in ("0.01", "0.02", "0.005", "0", "0.01:0.05", "0.01:0.01")
    for shape in ("armadillo", "lucy", "bunny")
)
FURTHER = {"bare": "without normals", "uneven": "uneven density"}
"""What a case may have at its end, and how its row says so."""
METHODS = ("ours", "uncleaned", "siren", "hash", "poisson")
GRADIENT_STEP = 5e-4
"""Length of the central differences that gradients are measured with."""
MOST_FACES = 2_000_000
"""A mesh of more faces fills the domain, and is not compared."""
GRADIENT_POINTS = 20_000
PICTURE = 320
"""Pixels along a side of a picture."""


def noisy_cloud(
    truth: SampledSurface, noise: float, outliers: float, seed: int, *, bare: bool = False, uneven: bool = False
) -> SurfacePoints:
    """Draw a cloud of a surface.

    noise: standard deviation. outliers: their number, as a share of the other points'. bare: with estimated normals.
    uneven: denser along x.
    """
    rng = np.random.default_rng(seed)
    points, face = truth.sample(4 * POINTS if uneven else POINTS, rng)
    if uneven:
        along = (points[:, 0] - points[:, 0].min()) / np.ptp(points[:, 0])
        kept = rng.choice(len(points), POINTS, replace=False, p=(0.1 + 0.9 * along) / (0.1 + 0.9 * along).sum())
        points, face = points[kept], face[kept]
    normals = truth.normals[face] + rng.normal(scale=noise, size=points.shape)
    count = int(POINTS * outliers)
    away, directions = rng.uniform(-1, 1, (count, 3)), rng.normal(size=(count, 3))
    moved = points + rng.normal(scale=noise, size=points.shape)
    everything = np.concatenate((moved, away))
    found = estimated_normals(everything)[0] if bare else unit(np.concatenate((normals, directions)))
    return SurfacePoints(everything, found)


class Reconstruction:
    """What a method makes of a cloud, in the truth's model space."""

    def __init__(self, name: str, shape: CloudShape, seconds: float, mesh: Mesh, trained: Trained | None) -> None:
        """mesh: in the cloud's model space. seconds: of the whole reconstruction, meshing aside."""
        self.name, self.seconds, self._shape, self._trained = name, seconds, shape, trained
        vertices = mesh.vertices * shape.scale + np.array(shape.centre)
        self.mesh = replace(mesh, vertices=vertices.astype(np.float32))

    def gradients(self, points: Doubles) -> Doubles | None:
        """Measure |grad f| at points (N, 3) of the truth by central differences; None where there is no field."""
        if self._trained is None:
            return None
        field = self._trained.field(Grid(256).diagonal)
        at = (points - np.array(self._shape.centre)) / self._shape.scale
        sides = [
            field.value((at + sign * GRADIENT_STEP * axis).astype(np.float32)) for axis in np.eye(3) for sign in (1, -1)
        ]
        differences = np.stack([a - b for a, b in zip(sides[::2], sides[1::2], strict=True)], axis=1)
        return np.asarray(np.linalg.norm(differences, axis=1) / (2 * GRADIENT_STEP), np.float64)


def ours(cloud: SurfacePoints, noise: float | None, options: argparse.Namespace) -> tuple[Trained, CloudShape]:
    """Train as `mplicits train` does. noise: as its option says."""
    began = time.perf_counter()
    shape = CloudShape(cloud.points, cloud.normals, None, "cloud", {}, noise)
    asked = replace(training_settings(options.levels, options.steps, seed=options.seed), noise=noise)
    model = Training(shape, asked, TrainingBar(quiet=True)).run()
    return of_model("ours" if noise is None else "ours, --noise 0", model, time.perf_counter() - began), shape


def poisson(cloud: SurfacePoints) -> Mesh:
    """Reconstruct by screened Poisson. Returns the mesh, in the cloud's space."""
    pymeshlab = import_module("pymeshlab")
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud.points, v_normals_matrix=cloud.normals))
    meshes.generate_surface_reconstruction_screened_poisson(threads=1)  # 16, as it would take, disturb one another
    made = meshes.current_mesh()
    return Mesh(made.vertex_matrix().astype(np.float32), made.face_matrix().astype(np.int64))


def reconstructions(cloud: SurfacePoints, options: argparse.Namespace) -> Iterator[Reconstruction]:
    """Reconstruct the cloud by all methods that were asked for, in turn."""
    exact = CloudShape(cloud.points, cloud.normals, None, "cloud", {}, 0.0)
    own, shape = ours(cloud, None, options)
    methods: dict[str, Callable[[], tuple[Trained, CloudShape]]] = {
        "ours": lambda: (own, shape),
        "uncleaned": lambda: ours(cloud, 0.0, options),
        "siren": lambda: (_siren(exact, own, options.seed), exact),
        "hash": lambda: (hash_grid(exact, 8, own.seconds, options.seed), exact),
    }
    for method in options.methods.split(","):
        if method == "poisson":
            began = time.perf_counter()
            mesh = poisson(cloud)
            mesh = replace(mesh, vertices=((mesh.vertices - exact.centre) / exact.scale).astype(np.float32))
            yield Reconstruction("screened Poisson", exact, time.perf_counter() - began, mesh, None)
        else:
            trained, of = methods[method]()
            field = trained.field(Grid(options.resolution).diagonal)
            yield Reconstruction(trained.name, of, trained.seconds, extract(field, options.resolution), trained)


def _siren(shape: CloudShape, own: Trained, seed: int) -> Trained:
    began = time.perf_counter()
    model = one_siren(shape, own.parameters, own.seconds, seed)
    return of_model("one SIREN", model, time.perf_counter() - began)


def row(case: str, made: Reconstruction, truth: Mesh, options: argparse.Namespace) -> str:
    """Compare a reconstruction with the truth. Returns its row."""
    if not len(made.mesh.faces):
        return f"| {case} | {made.name} | no surface | | | | | {made.seconds:.0f} |"
    if len(made.mesh.faces) > MOST_FACES:
        return f"| {case} | {made.name} | {len(made.mesh.faces):,} faces | | | | | {made.seconds:.0f} |"
    figures = compare(made.mesh, truth, options.samples)
    points, _ = SampledSurface(truth).sample(GRADIENT_POINTS, np.random.default_rng(1))
    lengths = made.gradients(points)
    gradient = "| "
    if lengths is not None:
        low, middle, high = np.quantile(lengths, (0.05, 0.5, 0.95))
        within = np.mean((lengths > 0.8) & (lengths < 1.2))
        gradient = f"{low:.2f}, {middle:.2f}, {high:.2f} | {within:.0%}"
    return (
        f"| {case} | {made.name} | {figures.chamfer:.2e} | {figures.chamfer / figures.floor:.2f} "
        f"| {figures.components} | {gradient} | {made.seconds:.0f} |"
    )


def picture(mesh: Mesh, path: Path) -> None:
    """Draw a mesh from the front, lit from the upper left, by its nearest samples at each pixel."""
    surface = SampledSurface(mesh)
    points, face = surface.sample(40 * PICTURE**2, np.random.default_rng(0))
    x, y = ((points[:, k] * side + 1) / 2 * (PICTURE - 1) for k, side in ((0, 1), (1, -1)))
    inside = (x >= 0) & (x < PICTURE) & (y >= 0) & (y < PICTURE)
    order = np.flatnonzero(inside)[np.argsort(points[inside, 2])]
    light = np.clip(surface.normals[face[order]] @ (-0.45, 0.55, 0.7), 0, 1)
    pixels = np.full((PICTURE, PICTURE), 255, np.uint8)
    pixels[y[order].astype(int), x[order].astype(int)] = (40 + 200 * light).astype(np.uint8)
    Image.fromarray(pixels).save(path, optimize=True)


def main() -> None:
    """Reconstruct every case by every method, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", default=CASES, metavar="SHAPE:NOISE[:OUTLIERS][:bare][:uneven],..")
    parser.add_argument("--methods", default=",".join(METHODS), metavar="NAME,..", help=f"of {', '.join(METHODS)}")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--steps", default="700,2500", metavar="N,..", help="of our levels (default 700,2500)")
    parser.add_argument("--resolution", type=int, default=256, metavar="N", help="of marching cubes (default 256)")
    parser.add_argument("--samples", type=int, default=500_000, metavar="N", help="of each surface (default 500,000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER")
    parser.add_argument("--pictures", action="store_true", help="draw the first case beside the page")
    parser.add_argument("--further", action="store_true", help="add rows to the page that is there")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/noise.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Noisy clouds",
        "",
        f"Printed by `python benchmarks/noise.py --methods {options.methods} --levels {options.levels} "
        f"--steps {options.steps} --resolution {options.resolution} --samples {options.samples}`, some cases at a time "
        "(`--cases`, then `--further`); what a row is stands at the head of that script. Chamfer: squared L2, both "
        "directions summed, in the truth's model space; that of a mesh which fills the domain with more than "
        f"{MOST_FACES:,} faces was not measured. |grad f|: 5th, 50th and 95th percentile on the true surface, and the "
        "share of it between 0.8 and 1.2. Cases and methods without a row were not run.",
        "",
        f"{machine()}.",
        "",
        "| cloud | method | Chamfer | of the floor | components | grad f | in 0.8 to 1.2 | seconds |",
        "| --- | --- | ---: | ---: | ---: | --- | ---: | ---: |",
        further=options.further,
    )
    drawn: list[str] = []
    for number, case in enumerate(options.cases.split(",")):
        words = [word for word in case.split(":") if word not in FURTHER]
        further = {word: word in case.split(":") for word in FURTHER}
        name, noise, outliers = (*words, "0")[:3]
        path = options.data / "meshes" / f"{name}.ply"
        mesh, _ = load_shape(str(path))
        truth = in_model_space(read_mesh(path), mesh.centre, mesh.scale)
        cloud = noisy_cloud(SampledSurface(truth), float(noise), float(outliers), options.seed + 1, **further)
        title = f"{name}, noise {float(noise):.1%}, outliers {float(outliers):.0%}"
        title += "".join(f", {says}" for word, says in FURTHER.items() if further[word])
        for made in reconstructions(cloud, options):
            page.add(row(title, made, truth, options))
            if options.pictures and not number and len(made.mesh.faces):
                file = options.output.with_name(f"noise-{made.name.split(',')[-1].strip(' -').replace(' ', '-')}.png")
                picture(made.mesh, file)
                drawn.append(f"![{title}, {made.name}]({file.name})")
    if drawn:
        page.add("", " ".join(drawn))


if __name__ == "__main__":
    main()
