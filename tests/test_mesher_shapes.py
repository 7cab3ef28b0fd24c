"""Models of real meshes at 256^3: what culling finds is what evaluation everywhere finds."""

import os
from pathlib import Path

import pytest
import trimesh

import mplicits
from codegen.model import load
from mesher.extract import extract_model
from nested import same_vertices

DATA = Path(os.environ.get("MPLICITS_DATA", Path(__file__).parent.parent.parent / "shared" / "data")) / "meshes"


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "levels"), [
    ("demo", "64x1,64x2"), ("armadillo.ply", "64x1,64x2"), ("lucy.ply", "64x1,64x1,64x2"),
])
def test_culled_vertices_are_those_of_the_last_level_everywhere(shape: str, levels: str, tmp_path: Path) -> None:
    source = shape if shape == "demo" else str(DATA / shape)
    if shape != "demo" and not (DATA / shape).is_file():
        pytest.skip(f"{shape} is not there; MPLICITS_DATA names its folder's parent")
    path = tmp_path / "m.safetensors"
    assert mplicits.main(["train", source, "-o", str(path), "--levels", levels, "--seconds", "25", "--quiet"]) == 0
    model = load(path)
    found = same_vertices(model, 256)
    print(shape, found)
    assert (found.missing, found.extra) == (0, 0)
    assert found.vertices > 50_000
    mesh = extract_model(model, 256).mesh
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
