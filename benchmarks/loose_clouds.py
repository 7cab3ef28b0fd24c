"""Clouds as feed-forward models give them: is what they become closed and right side out? A page and pictures.

    python benchmarks/loose_clouds.py [--cases bunny:0.01:0.05:bare,...] [--steps 300,900] [-o FILE]

Cases are noise.py's, and so are the clouds: noise, outliers, no normals, uneven density. Each is trained as `mplicits
train CLOUD` does. Angles are between normals of the mesh that comes out and of the true one: of a surface that is
inside out they are near 180 degrees.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from mplicits.mesher.evaluate import compare
from mplicits.mesher.metrics import SampledSurface
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from noise import FURTHER, noisy_cloud, picture, reconstructions
from protocol import DATA, Page, machine

CASES = "bunny:0.01:0.05,bunny:0.01:0.05:bare,bunny:0.01:0.05:bare:uneven"


def main() -> None:
    """Train every case, and write the page and the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", default=CASES, metavar="SHAPE:NOISE[:OUTLIERS][:bare][:uneven],..")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--steps", default="300,900", metavar="N,..")
    parser.add_argument("--resolution", type=int, default=192, metavar="N", help="of marching cubes (default 192)")
    parser.add_argument("--samples", type=int, default=300_000, metavar="N", help="of each surface (default 300,000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/loose_clouds.md"))
    options = parser.parse_args()
    options.methods = "ours"
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# Loose clouds",
        "",
        "Clouds of 100,000 points as feed-forward models give them, trained as `mplicits train CLOUD` does. Without "
        "normals: these are estimated. Uneven: ten times as dense at one end as at the other. Chamfer: squared L2, "
        "both directions summed, in the truth's model space. Normals: mean angle to the true ones, degrees; of a "
        "surface that is inside out it is near 180.",
        "",
        f"Printed by `python benchmarks/loose_clouds.py --cases {options.cases} --levels {options.levels} "
        f"--steps {options.steps} --resolution {options.resolution} --samples {options.samples}`, {machine()}.",
        "",
        "| cloud | Chamfer | of the floor | normals | components | watertight | seconds |",
        "|---|---:|---:|---:|---:|---|---:|",
    )
    views = []
    for case in options.cases.split(","):
        words = [word for word in case.split(":") if word not in FURTHER]
        further = {word: word in case.split(":") for word in FURTHER}
        name, noise, outliers = (*words, "0")[:3]
        path = DATA / "meshes" / f"{name}.ply"
        mesh, _ = load_shape(str(path))
        truth = in_model_space(read_mesh(path), mesh.centre, mesh.scale)
        cloud = noisy_cloud(SampledSurface(truth), float(noise), float(outliers), options.seed + 1, **further)
        title = f"{name}, noise {float(noise):.1%}, outliers {float(outliers):.0%}"
        title += "".join(f", {says}" for word, says in FURTHER.items() if further[word])
        (made,) = reconstructions(cloud, options)
        if not len(made.mesh.faces):
            page.add(f"| {title} | no surface | | | | | {made.seconds:.0f} |")
            continue
        found = compare(made.mesh, truth, options.samples)
        page.add(
            f"| {title} | {found.chamfer:.2e} | {found.chamfer / found.floor:.2f} | {found.normal_angle:.1f} "
            f"| {found.components} | {'yes' if found.watertight else 'no'} | {made.seconds:.0f} |"
        )
        file = options.output.with_suffix(".png")
        picture(made.mesh, file)
        views.append(np.asarray(Image.open(file)))
        Image.fromarray(np.concatenate(views, axis=1)).save(file, optimize=True)
    if views:
        page.add("", f"In the order of the rows:\n\n![Surfaces of loose clouds]({options.output.stem}.png)")


if __name__ == "__main__":
    main()
