"""Each verb of the command line and its Python function have the same options and results."""

import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

import mplicits
from mplicits import cli
from mplicits.model.model_file import load, save
from mplicits.model.options import declarations
from mplicits.trainer.shapes.load import load_shape
from support.ball_training import use_quick_config
from support.paths import DEMO
from support.random_model import random_model

FUNCTIONS: dict[str, Callable[..., object]] = {
    "train": mplicits.train,
    "check": mplicits.check,
    "morph": mplicits.morph,
    "unproject": mplicits.unproject,
    "photos": mplicits.photos,
    "bake": mplicits.Field.bake,
    "pack": mplicits.Field.pack,
    "render": mplicits.Field.render,
    "mesh": mplicits.Field.mesh,
    "eval": mplicits.evaluate,
    "report": mplicits.report,
    "compose": mplicits.compose,
    "import": mplicits.import_checkpoints,
}
"""Verb -> its Python function."""
COMMAND_LINE_ONLY = {
    "render": {"benchmark", "frames", "fps", "once", "turn"},
    "train": {"live", "jobs"},
    "morph": {"live"},
    "photos": {"resume"},
}
"""Options that a verb's Python function does not have, beside those of files and of printing."""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_verbs_and_functions_have_the_same_options(name: str) -> None:
    schema = cli.verbs()[name].options
    verb, function = inspect.signature(schema).parameters, inspect.signature(FUNCTIONS[name]).parameters
    apart = {"output", "force", "json", *COMMAND_LINE_ONLY.get(name, ()), *({"model"} if "self" in function else ())}
    for option in declarations(schema).keys() - apart:
        assert option in function
        if option not in {"resume", "preview"}:  # Python takes a Field for `resume`, and True for `preview`.
            assert function[option].default in (inspect.Parameter.empty, verb[option].default), option


def test_every_verb_has_a_function() -> None:
    assert set(cli.verbs()) == {*FUNCTIONS, "demo", "view", "info", "studio", "gallery"}


def test_render_equals_the_verb(tmp_path: Path) -> None:
    path = tmp_path / "p.png"
    argv = f"-o {path} --size 40x32 --camera 10,20 --background ffffff --context osmesa --level 1 --storage texture"
    assert cli.main(["render", str(DEMO), *argv.split()]) == 0
    field = mplicits.load(DEMO)
    image = field.render((40, 32), camera=(10, 20), background="#ffffff", context="osmesa", level=1, storage="texture")
    assert image.shape == (32, 40, 3)
    np.testing.assert_array_equal(image, np.asarray(Image.open(path)))
    transparent = field.render(16, transparent=True, context="osmesa", storage="texture")
    assert transparent.shape == (16, 16, 4)
    assert transparent.dtype == np.uint8
    with pytest.raises(mplicits.UserError, match="RRGGBB"):
        field.render(16, background="red")


def test_mesh_equals_the_verb(tmp_path: Path) -> None:
    assert cli.main(["mesh", str(DEMO), "-o", str(tmp_path / "verb.ply"), "--resolution", "32", "--quiet"]) == 0
    mesh = mplicits.load(DEMO).mesh(32, quiet=True)
    mesh.save(tmp_path / "ours.ply")
    assert (tmp_path / "verb.ply").read_bytes() == (tmp_path / "ours.ply").read_bytes()
    copy = mesh.to_trimesh()
    assert copy.is_watertight
    np.testing.assert_allclose(copy.vertices, mesh.vertices)
    assert mesh.colors is not None
    assert mesh.normals.shape == mesh.vertices.shape == mesh.colors.shape
    assert repr(mesh) == f"<mplicits.TriangleMesh: {len(mesh.vertices):,} vertices, {len(mesh.faces):,} faces>"
    with pytest.raises(mplicits.UserError, match="a mesh is written as"):
        mesh.save(tmp_path / "mesh.txt")


def test_bake_and_info_equal_the_verbs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "small.safetensors"
    save(random_model((8, 0), (8, 1)), path)
    field = mplicits.load(path)
    assert cli.main(["info", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(field.info()))
    argv = ["-o", str(tmp_path / "verb.glsl"), "--target", "glsl300es", "--digits", "4"]
    assert cli.main(["bake", str(path), *argv]) == 0
    text = field.bake("glsl300es", tmp_path / "ours.glsl", digits=4)
    assert text == (tmp_path / "verb.glsl").read_text() == (tmp_path / "ours.glsl").read_text()
    with pytest.raises(mplicits.UserError, match="--precision: not allowed with --digits"):
        field.bake(precision="float16", digits=3)


def test_evaluate_equals_the_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = tmp_path / "truth.ply"
    mplicits.load(DEMO).mesh(24, quiet=True).save(truth)
    argv = ["eval", str(DEMO), str(truth), "--resolution", "24", "--samples", "2000", "--json", "--quiet"]
    assert cli.main(argv) == 0
    printed = json.loads(capsys.readouterr().out)
    evaluation = mplicits.evaluate(DEMO, truth, 24, samples=2000, quiet=True)
    assert printed["chamfer"] == evaluation.figures.chamfer
    assert evaluation.field is not None
    assert printed["field"]["band_error"] == evaluation.field.band_error


def test_train_equals_the_verb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_quick_config(monkeypatch)
    trimesh.creation.icosphere(2, 2.0).export(tmp_path / "ball.ply", vertex_normal=False)
    output = tmp_path / "verb.safetensors"
    argv = ["--levels", "8x0,8x1", "--steps", "20,10", "--omega", "8,16", "--quiet"]
    assert cli.main(["train", str(tmp_path / "ball.ply"), "-o", str(output), *argv]) == 0
    told: list[tuple[str, float, float]] = []
    levels: list[mplicits.Field] = []

    def callback(stage: str, fraction: float, loss: float) -> None:
        told.append((stage, fraction, loss))

    options = {"steps": (20, 10), "omega": [8, 16], "quiet": True, "callback": callback, "after_level": levels.append}
    mesh = trimesh.load(tmp_path / "ball.ply", process=False)
    ours = mplicits.train(mesh, ["8x0", "8x1"], **options)  # type: ignore[arg-type]
    assert ours.model.sha256() == load(output).sha256()
    assert {stage for stage, _, _ in told} == {"level 1 (8x0)", "level 2 (8x1)"}
    assert [len(field.levels) for field in levels] == [1, 2]


@pytest.mark.slow
def test_morph_and_motion_equal_the_verbs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_quick_config(monkeypatch)
    for name, stretch in (("0.ply", 1.0), ("1.ply", 1.5)):
        trimesh.creation.icosphere(1).apply_scale((stretch, 1, 1)).export(tmp_path / name)
    argv = ["--levels", "8x0", "--steps", "4", "--quiet", "--texture", "none"]
    options = {"steps": 4, "quiet": True, "texture": "none"}
    first, second = str(tmp_path / "0.ply"), tmp_path / "1.ply"
    output = tmp_path / "verb.safetensors"
    assert cli.main(["morph", first, str(second), "--in-place", "-o", str(output), *argv]) == 0
    ours = mplicits.morph(first, second, "8x0", in_place=True, **options)  # type: ignore[arg-type]
    assert ours.model.sha256() == load(output).sha256()
    assert cli.main(["train", str(tmp_path), "--time", "-o", str(output), "--force", *argv]) == 0
    ours = mplicits.train(tmp_path, "8x0", time=True, **options)  # type: ignore[arg-type]
    assert ours.model.sha256() == load(output).sha256()
    with pytest.raises(mplicits.UserError, match=r"--texture image\.png: choose from auto, none"):
        mplicits.morph(first, second, "8x0", texture="image.png")
    with pytest.raises(mplicits.UserError, match="needs the path of a folder of meshes"):
        mplicits.train((np.eye(3), np.array([[0, 1, 2]])), "8x0", time=True)


def test_unproject_equals_the_verb(tmp_path: Path) -> None:
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    np.save(tmp_path / "depth.npy", np.where(x**2 + y**2 < 0.5, 3 - 0.5 * np.sqrt(1 - x**2 / 2 - y**2 / 2), 0))
    argv = ["unproject", str(tmp_path / "depth.npy"), "-o", str(tmp_path / "verb.ply"), "--fov", "40"]
    assert cli.main([*argv, "--range", "1,5"]) == 0
    cloud = mplicits.unproject(tmp_path / "depth.npy", fov=40, range=(1, 5))
    cloud.save(tmp_path / "ours.ply")
    assert (tmp_path / "verb.ply").read_bytes() == (tmp_path / "ours.ply").read_bytes()
    assert repr(cloud) == f"<mplicits.Unprojected: {len(cloud.points):,} points with normals, without colors>"
    shape, _ = load_shape(cloud.arrays(), up="y", noise=0)
    assert not shape.colored
    with pytest.raises(mplicits.UserError, match="clouds are PLY"):
        cloud.save(tmp_path / "cloud.xyz")
    with pytest.raises(mplicits.UserError, match="and not both"):
        mplicits.unproject()


def test_arrays_are_shapes() -> None:
    ball = trimesh.creation.icosphere(3, 2.0)
    mesh, _ = load_shape((ball.vertices + 5, ball.faces), up="y")
    turned, _ = load_shape((ball.vertices + np.array([5, 6, 7]), ball.faces.tolist()), up="z")
    cloud, _ = load_shape((ball.vertices.tolist(), ball.vertex_normals, abs(ball.vertex_normals)), up="y", noise=0)
    assert mesh.center == pytest.approx((5, 5, 5))
    assert mesh.scale == pytest.approx(2)
    assert turned.center == pytest.approx((5, 7, -6))
    assert (mesh.colored, cloud.colored) == (False, True)
    for shape in (mesh, cloud):
        np.testing.assert_allclose(shape.distance(np.array([[0, 0, 0.9], [0, 0, 1.5]])), [-0.1, 0.5], atol=0.01)


def test_a_callback_may_end_a_training() -> None:
    def callback(stage: str, fraction: float, loss: float) -> None:
        if fraction > 0.2:
            raise KeyboardInterrupt

    field = mplicits.train("demo", "8x0", steps=40, texture="none", quiet=True, callback=callback)
    assert field.model.provenance["interrupted"]


def test_wrong_arguments_of_train_are_refused() -> None:
    vertices = trimesh.creation.icosphere(1).vertices
    cases: tuple[tuple[Any, str], ...] = (
        ((vertices, np.array([[0, 1, 99]])), "faces refer to missing vertices"),
        ((vertices, np.array([[0, 1]])), r"\(F, 3\) is needed"),
        ((vertices, vertices[:5]), "differ in number"),
        ((vertices[:, :2], vertices), r"\(N, 3\) is needed"),
        (7, "a shape is a file"),
        ((vertices, vertices + 0.5, vertices, vertices), "a shape is a file"),
    )
    for shape, message in cases:
        with pytest.raises(mplicits.UserError, match=message):
            mplicits.train(shape, "8x0", steps=1, quiet=True)
    with pytest.raises(mplicits.UserError, match="--seconds: not allowed with --steps"):
        mplicits.train("demo", "8x0", seconds=5, steps=5)
