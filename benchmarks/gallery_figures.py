"""Measures the surfaces of the gallery's models against their meshes, and writes the figures into the model files.

    python benchmarks/gallery_figures.py FOLDER

FOLDER has the meshes of model/gallery/README.md. New trainings measure themselves; models that move are left out.
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
    """Measure each model whose mesh is in the folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    folder = parser.parse_args().folder
    meshes = {hashlib.sha256(path.read_bytes()).hexdigest(): path for path in folder.glob("*.obj")}
    for path in map(gallery.model_path, gallery.names()):
        model = load(path)
        source = model.provenance["source"]
        if (mesh := meshes.get(source.get("sha256"))) is None:
            continue
        shape, _ = load_shape(str(mesh), crease=source["crease"])
        found = SurfaceDistance(shape, torch.device("cpu")).measure(*moved(model, shape))
        save(replace(model, provenance=model.provenance | {"surface": found.to_json()}), path)
        print(f"{model.name}: " + "; ".join(f"{label} {text}" for label, text in found.told()))


if __name__ == "__main__":
    main()
