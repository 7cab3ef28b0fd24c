"""A shape lies as its file has it, and model space has y up whichever axis of the file points up."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.read_meshes import in_model_space, read_mesh
from mplicits.model.errors import UserError
from mplicits.model.model_file import load, save
from mplicits.model.orientation import UPRIGHT, as_in_file, upright
from mplicits.trainer.shapes.load import load_shape
from mplicits.viewer.draw.triangles import read_triangles_for
from support.ball_training import use_quick_config
from support.random_model import random_model


@pytest.mark.parametrize("up", UPRIGHT)
def test_the_axis_that_is_up_becomes_y_without_mirroring(up: str) -> None:
    axes = np.eye(3)
    sign = -1 if up[0] == "-" else 1
    np.testing.assert_array_equal(upright(sign * axes["xyz".index(up[-1])], up), (0, 1, 0))
    turned = upright(axes, up)
    np.testing.assert_allclose(np.cross(turned[0], turned[1]), turned[2], err_msg="a rotation, no reflection")
    np.testing.assert_array_equal(as_in_file(turned, up), axes)
    if up == "z":
        np.testing.assert_array_equal(upright(np.array([0, -1, 0]), up), (0, 0, 1), "a front of -y is seen from +z")


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".xyz"])
def test_a_shape_is_turned_upright_and_its_file_is_found_there_again(suffix: str, tmp_path: Path) -> None:
    cone = trimesh.creation.cone(radius=1.0, height=3.0)  # along z, from 0 up
    cone.apply_translation((5.0, 6.0, 7.0))
    path = tmp_path / f"cone{suffix}"
    if suffix == ".xyz":
        points, faces = cone.sample(2000, return_index=True)
        np.savetxt(path, np.concatenate((points, cone.face_normals[faces]), axis=1))
    else:
        cone.export(path)
    shape, _ = load_shape(str(path), up="z")
    points = shape.surface(20_000, np.random.default_rng(0)).points
    thick = [np.linalg.norm(points[points[:, 1] * side > 0.5][:, ::2], axis=1).max() for side in (-1, 1)]
    assert thick[0] > 2 * thick[1], "the cone's tip is at the top"
    assert shape.source["up"] == "z"
    if suffix == ".xyz":
        return
    model = replace(random_model((4, 0)), center=shape.center, scale=shape.scale, up="z")
    truth = in_model_space(read_mesh(path), *model.place)
    np.testing.assert_allclose(shape.distance(truth.vertices.astype(float)), 0, atol=1e-6)
    triangles = read_triangles_for(model, path, "input")
    np.testing.assert_allclose(np.ptp(triangles.vertices, axis=0), np.ptp(truth.vertices, axis=0), atol=1e-6)
    assert (triangles.vertices * triangles.normals).sum(axis=1).mean() > 0.3, "normals are turned too"


def test_a_mesh_of_the_model_lies_in_the_file_s_axes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model = replace(random_model((8, 1)), center=(1.0, 2.0, 3.0), scale=2.0)
    for up in UPRIGHT:
        save(replace(model, up=up), tmp_path / f"{up}.safetensors")
        assert cli.main(["mesh", str(tmp_path / f"{up}.safetensors"), "--resolution", "16", "--quiet"]) == 0
    meshes = {up: trimesh.load_mesh(f"{up}.ply", process=False) for up in UPRIGHT}
    for up, mesh in meshes.items():
        np.testing.assert_allclose(upright(mesh.vertices, up), meshes["y"].vertices, atol=1e-5)
        np.testing.assert_allclose(upright(mesh.vertex_normals, up), meshes["y"].vertex_normals, atol=1e-5)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"up": "w"}, "up: 'w' is none of"),
        ({"front": (1.0,)}, "two numbers"),
        ({"front": (0.0, 91.0)}, "-90 to 90"),
        ({"front": (float("nan"), 0.0)}, "finite"),
        ({"credit": None}, "credit: not a text"),
    ],
)
def test_a_wrong_presentation_is_refused(more: dict[str, object], said: str) -> None:
    with pytest.raises(UserError, match=said):
        replace(random_model((4, 0)), **more)  # type: ignore[arg-type]


def test_training_keeps_up_front_and_credit_and_resuming_may_change_the_last_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    use_quick_config(monkeypatch)
    trimesh.creation.cone(radius=1.0, height=3.0).export("cone.obj")
    train = ["train", "cone.obj", "--levels", "8x0", "--steps", "20", "--quiet"]
    assert cli.main([*train, "--up", "z", "--front=-30,10", "--credit", "Nobody, CC0"]) == 0
    model = load(Path("cone.safetensors"))
    assert (model.up, model.front, model.credit) == ("z", (-30.0, 10.0), "Nobody, CC0")
    assert cli.main([*train, "--resume", "--front", "215,15"]) == 0
    again = load(Path("cone.safetensors"))
    assert (again.up, again.front, again.credit) == ("z", (215.0, 15.0), "Nobody, CC0")
    assert again.sha256() == model.sha256()
    capsys.readouterr()
    for option, said in (("--front", "two numbers"), ("--front=0,100", "-90 to 90"), ("--front=a,b", "not a number")):
        assert cli.main([*train, *([option, "1"] if "=" not in option else [option])]) == 2
        assert said in capsys.readouterr().err
