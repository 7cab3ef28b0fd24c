"""Measures the surfaces of the gallery's models against their meshes: writes docs/results/surfaces.md.

    python benchmarks/surfaces.py FOLDER [-o docs/results/surfaces.md]

FOLDER has the meshes of model/gallery/README.md. The model files get the figures, too, as of a new training.
"""

import argparse
import hashlib
from dataclasses import replace
from pathlib import Path

import torch

from mplicits.model import gallery
from mplicits.model.model import Model
from mplicits.model.model_file import load, save
from mplicits.trainer.networks.network import Weights, from_model
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.surface_distance import SurfaceDistance
from protocol import Page, machine


def moved(model: Model, shape: Shape) -> tuple[list[Weights], list[float]]:
    """Return the networks and deltas of a model for points in a shape's model space.

    Curved surfaces bulge, and how much has changed since the models were trained: so has the sphere around them.
    """
    factor, networks = shape.scale / model.scale, []
    shift = (torch.tensor(shape.center) - torch.tensor(model.center)).float() / model.scale
    for level in model.levels:
        weights = from_model(level.network)
        weights[1] = weights[1] + weights[0] @ shift
        weights[0] = weights[0] * factor
        networks.append([*weights[:-2], weights[-2] / factor, weights[-1] / factor])
    return networks, [level.delta / factor for level in model.levels]


def main() -> None:
    """Measure each model whose mesh is in the folder, and write a row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/surfaces.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# The surfaces of the gallery",
        "",
        f"Printed by `python benchmarks/surfaces.py {options.folder.name}`. {machine()}.",
        "",
        "Off by: distance between the surfaces of model and mesh, mean of both directions, in radii of the shape. "
        "Normals by: mean angle between gradient and normal, degrees. First against the curved surface that the "
        "training makes of the mesh, then against its flat faces ([figures](../training.md#what-the-figures-mean)). "
        "Training: on two cores. The model that moves is left out.",
        "",
        "| model | parameters | training, s | off by | normals by | flat faces: off by | normals by | invented |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    )
    meshes = {hashlib.sha256(path.read_bytes()).hexdigest(): path for path in options.folder.glob("*.obj")}
    for path in map(gallery.model_path, gallery.names()):
        model = load(path)
        source = model.provenance["source"]
        if (mesh := meshes.get(source.get("sha256"))) is None:
            continue
        shape, _ = load_shape(str(mesh), crease=source["crease"])
        found = SurfaceDistance(shape, torch.device("cpu")).measure(*moved(model, shape))
        save(replace(model, provenance=model.provenance | {"surface": found.to_json()}), path)
        assert found.flat is not None
        told = " | ".join(f"{part.distance:.1e} | {part.normal_angle:.1f}" for part in (found.shape, found.flat))
        page.add(
            f"| {model.name} | {model.parameters():,} | {model.provenance['seconds']:.0f} | {told} "
            f"| {found.shape.invented or 0:.1%} |"
        )


if __name__ == "__main__":
    main()
