"""On models of real meshes at 256^3, culling finds what evaluation at every vertex finds."""

from pathlib import Path

import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.extract import extract_model
from mplicits.model.model_file import load
from support.nested import same_vertices
from support.paths import DATA

MESHES = DATA / "meshes"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "levels"),
    [
        ("demo", "64x1,64x2"),
        ("armadillo.ply", "64x1,64x2"),
        ("lucy.ply", "64x1,64x1,64x2"),
    ],
)
def test_culled_vertices_are_those_of_the_last_level_everywhere(shape: str, levels: str, tmp_path: Path) -> None:
    source = shape if shape == "demo" else str(MESHES / shape)
    if shape != "demo" and not (MESHES / shape).is_file():
        pytest.skip(f"{shape} is not there; MPLICITS_DATA names its folder's parent")
    path = tmp_path / "m.safetensors"
    steps = levels.count(",") * "600," + "1000"
    assert cli.main(["train", source, "-o", str(path), "--levels", levels, "--steps", steps, "--quiet"]) == 0
    model = load(path)
    comparison = same_vertices(model, 256)
    print(shape, comparison)
    assert (comparison.missing, comparison.extra) == (0, 0)
    assert comparison.vertices > 50_000
    mesh = extract_model(model, 256).mesh
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
