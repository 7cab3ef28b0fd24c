"""On models of real shapes, culling finds what evaluation at every vertex of the grid finds."""

from pathlib import Path

import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.extract import extract_model
from mplicits.model import gallery
from mplicits.model.model import Model
from mplicits.model.model_file import load
from support import needs
from support.nested import same_vertices
from support.paths import DATA

ARMADILLO = DATA / "meshes" / "armadillo.ply"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spot", "spot-large"])
def test_culling_keeps_all_vertices_of_a_good_model(name: str) -> None:
    assert_whole(load(gallery.model_path(name)))


@pytest.mark.slow
@needs.data(ARMADILLO)
def test_culling_keeps_all_vertices_of_a_rough_model(tmp_path: Path) -> None:
    path = tmp_path / "m.safetensors"
    argv = ["train", str(ARMADILLO), "-o", str(path), "--levels", "64x1,64x2", "--steps", "200,300", "--quiet"]
    assert cli.main(argv) == 0
    assert_whole(load(path))


def assert_whole(model: Model) -> None:
    comparison = same_vertices(model, 192)
    assert (comparison.missing, comparison.extra) == (0, 0)
    assert comparison.vertices > 25_000
    mesh = extract_model(model, 192).mesh
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
