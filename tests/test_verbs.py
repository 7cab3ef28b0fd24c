"""Each verb of the command line is a thin skin over a function of `import mplicits`: same names, defaults, results."""

import argparse
import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
import trimesh
from PIL import Image

import mplicits
from mplicits import cli
from mplicits.bake.bake import bake
from mplicits.capture.photo_settings import PhotoOptions, photo_settings
from mplicits.capture.photos_session import photos
from mplicits.capture.unprojected import unprojected
from mplicits.mesher.evaluation import evaluate
from mplicits.mesher.made import make_mesh
from mplicits.model.model_file import load
from mplicits.reporting.page import report
from mplicits.scenes.composed import compose
from mplicits.trainer.imported import import_checkpoints
from mplicits.trainer.learn import learn, morph
from mplicits.trainer.options import TrainingOptions, settings_from
from mplicits.trainer.shapes.given import given_shape
from mplicits.viewer.still import Asked
from support.paths import DEMO

OF_FILES = {"output", "force", "json"}
"""Options that say where a verb's result goes: a function returns it."""
OF_THE_COMMAND_LINE = {
    "render": {"benchmark", "frames", "fps", "once", "turn"},
    "train": {"live", "jobs", "cluster"},
    "morph": {"live"},
    "photos": {"resume"},
}
"""Options of the command line's own, which a function does not take."""
VERBS: dict[str, tuple[Callable[..., object], Callable[..., object]]] = {
    "train": (mplicits.train, learn),
    "morph": (mplicits.morph, morph),
    "unproject": (mplicits.unproject, unprojected),
    "photos": (mplicits.photos, photos),
    "bake": (mplicits.Field.bake, bake),
    "render": (mplicits.Field.render, Asked),
    "mesh": (mplicits.Field.mesh, make_mesh),
    "eval": (mplicits.evaluate, evaluate),
    "report": (mplicits.report, report),
    "compose": (mplicits.compose, compose),
    "import": (mplicits.import_checkpoints, import_checkpoints),
}
"""Verb -> what `import mplicits` offers, and the room's function that both call."""
OF_OTHER_ROOMS = {"model", "preview"}
"""What a room's own function does not take: a model is its first argument, and pictures are drawn elsewhere."""
PROGRAMS = {"demo", "view", "info"}
"""Verbs that have no function, and `info`, whose function is Field.info."""


def defaults(name: str) -> dict[str, object]:
    """Each option of a verb, and positional argument, and its default, as the verb's function would take it."""
    parser = cli.Parser()
    cli.verbs()[name].arguments(parser)
    options = {}
    for action in parser._actions:
        if not isinstance(action, argparse._HelpAction):
            default = action.default
            if isinstance(default, str) and callable(action.type):
                default = action.type(default)
            options[action.dest] = default
    return options


def same(function: object, option: object) -> bool:
    """Whether a function's default is an option's: a size may be one number; what is a flag there may be None here."""
    return option in (function, (function, function)) or (function is None and option is False)


@pytest.mark.parametrize("name", VERBS)
def test_names_and_defaults_are_one(name: str) -> None:
    apart = OF_FILES | OF_THE_COMMAND_LINE.get(name, set())
    options = {key: default for key, default in defaults(name).items() if key not in apart}
    for function in VERBS[name]:
        parameters = inspect.signature(function).parameters
        assert set(options) - OF_OTHER_ROOMS <= set(parameters), function
        for key, option in options.items():
            if key in parameters and parameters[key].default is not inspect.Parameter.empty:
                assert same(parameters[key].default, option), (function, key)


@pytest.mark.parametrize(("options", "taker"), [(TrainingOptions, settings_from), (PhotoOptions, photo_settings)])
def test_options_are_said_alike_twice(options: type, taker: Callable[..., object]) -> None:
    named = get_type_hints(taker)
    for other in {"return", "levels"} - get_type_hints(options).keys():
        del named[other]
    assert named == get_type_hints(options)


def test_every_verb_has_a_function() -> None:
    assert set(cli.verbs()) == {*VERBS, *PROGRAMS}


def test_render_draws_what_the_verb_writes(tmp_path: Path) -> None:
    path = tmp_path / "p.png"
    argv = [
        "--size",
        "40x32",
        "--camera",
        "10,20",
        "--background",
        "ffffff",
        "--context",
        "osmesa",
        "--level",
        "1",
        "--storage",
        "texture",
    ]
    assert cli.main(["render", str(DEMO), "-o", str(path), *argv]) == 0
    field = mplicits.load(DEMO)
    image = field.render((40, 32), camera=(10, 20), background="#ffffff", context="osmesa", level=1, storage="texture")
    assert image.shape == (32, 40, 3)
    np.testing.assert_array_equal(image, np.asarray(Image.open(path)))
    transparent = field.render(16, transparent=True, context="osmesa", storage="texture")
    assert transparent.shape == (16, 16, 4)
    assert transparent.dtype == np.uint8
    with pytest.raises(mplicits.UserError, match="RRGGBB"):
        field.render(16, background="red")


def test_mesh_makes_what_the_verb_writes(tmp_path: Path) -> None:
    assert cli.main(["mesh", str(DEMO), "-o", str(tmp_path / "verb.ply"), "--resolution", "32", "--quiet"]) == 0
    made = mplicits.load(DEMO).mesh(32, quiet=True)
    made.save(tmp_path / "ours.ply")
    assert (tmp_path / "verb.ply").read_bytes() == (tmp_path / "ours.ply").read_bytes()
    again = made.to_trimesh()
    assert again.is_watertight
    np.testing.assert_allclose(again.vertices, made.vertices)
    assert made.colors is not None
    assert made.normals.shape == made.vertices.shape == made.colors.shape
    assert repr(made) == f"<mplicits.TriangleMesh: {len(made.vertices):,} vertices, {len(made.faces):,} faces>"
    with pytest.raises(mplicits.UserError, match="a mesh is written as"):
        made.save(tmp_path / "mesh.txt")


def test_bake_gives_what_the_verb_writes(tmp_path: Path) -> None:
    options = ["--target", "glsl300es", "--digits", "4"]
    assert cli.main(["bake", str(DEMO), "-o", str(tmp_path / "verb.glsl"), *options]) == 0
    text = mplicits.load(DEMO).bake("glsl300es", tmp_path / "ours.glsl", digits=4)
    assert text == (tmp_path / "verb.glsl").read_text() == (tmp_path / "ours.glsl").read_text()
    for wrong, said in (
        ({"target": "gsl"}, "--target gsl: there is glsl330"),
        ({"precision": "half"}, "--precision half"),
        ({"precision": "float16", "digits": 3}, "not allowed with"),
    ):
        with pytest.raises(mplicits.UserError, match=said):
            mplicits.load(DEMO).bake(**wrong)


def test_info_and_eval_say_what_the_verbs_print(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    field = mplicits.load(DEMO)
    assert cli.main(["info", str(DEMO), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(field.info()))
    truth = tmp_path / "truth.ply"
    field.mesh(24, quiet=True).save(truth)
    argv = ["eval", str(DEMO), str(truth), "--resolution", "24", "--samples", "2000", "--json", "--quiet"]
    assert cli.main(argv) == 0
    printed = json.loads(capsys.readouterr().out)
    evaluation = mplicits.evaluate(DEMO, truth, 24, samples=2000, quiet=True)
    assert printed["chamfer"] == evaluation.figures.chamfer
    assert evaluation.field is not None
    assert printed["field"]["band_error"] == evaluation.field.band_error


def test_train_learns_what_the_verb_learns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.mesher.survey.RESOLUTION", 16)
    trimesh.creation.icosphere(2, 2.0).export(tmp_path / "ball.ply", vertex_normal=False)
    output = tmp_path / "verb.safetensors"
    argv = ["--levels", "8x0,8x1", "--steps", "20,10", "--omega", "8,16", "--quiet"]
    assert cli.main(["train", str(tmp_path / "ball.ply"), "-o", str(output), *argv]) == 0
    told: list[tuple[str, float, float]] = []
    levels: list[mplicits.Field] = []

    def callback(stage: str, fraction: float, loss: float) -> None:
        told.append((stage, fraction, loss))

    options = {"steps": (20, 10), "omega": [8, 16], "quiet": True, "callback": callback, "follow": levels.append}
    mesh = trimesh.load(tmp_path / "ball.ply", process=False)
    ours = mplicits.train(mesh, ["8x0", "8x1"], **options)  # type: ignore[arg-type]
    assert ours.model.sha256() == load(output).sha256()
    assert {stage for stage, _, _ in told} == {"level 1 (8x0)", "level 2 (8x1)"}
    assert [len(field.levels) for field in levels] == [1, 2]


@pytest.mark.slow
def test_morph_and_moments_learn_what_the_verbs_learn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.mesher.survey.RESOLUTION", 16)
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
    with pytest.raises(mplicits.UserError, match=r"--texture image\.png: auto or none"):
        mplicits.morph(first, second, "8x0", texture="image.png")
    with pytest.raises(mplicits.UserError, match="a folder of meshes is needed"):
        mplicits.train((np.eye(3), np.array([[0, 1, 2]])), "8x0", time=True)


def test_unproject_gives_what_the_verb_writes(tmp_path: Path) -> None:
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    np.save(tmp_path / "depth.npy", np.where(x**2 + y**2 < 0.5, 3 - 0.5 * np.sqrt(1 - x**2 / 2 - y**2 / 2), 0))
    argv = ["unproject", str(tmp_path / "depth.npy"), "-o", str(tmp_path / "verb.ply"), "--fov", "40"]
    assert cli.main([*argv, "--range", "1,5"]) == 0
    cloud = mplicits.unproject(tmp_path / "depth.npy", fov=40, range=(1, 5))
    cloud.save(tmp_path / "ours.ply")
    assert (tmp_path / "verb.ply").read_bytes() == (tmp_path / "ours.ply").read_bytes()
    assert repr(cloud) == f"<mplicits.Unprojected: {len(cloud.points):,} points with normals, without colours>"
    shape, _ = given_shape(cloud.arrays(), up="y", noise=0)
    assert not shape.coloured
    with pytest.raises(mplicits.UserError, match="clouds are PLY"):
        cloud.save(tmp_path / "cloud.xyz")
    with pytest.raises(mplicits.UserError, match="and not both"):
        mplicits.unproject()


def test_arrays_are_shapes() -> None:
    ball = trimesh.creation.icosphere(3, 2.0)
    mesh, _ = given_shape((ball.vertices + 5, ball.faces), up="y")
    turned, _ = given_shape((ball.vertices + np.array([5, 6, 7]), ball.faces.tolist()), up="z")
    cloud, _ = given_shape((ball.vertices.tolist(), ball.vertex_normals, abs(ball.vertex_normals)), up="y", noise=0)
    assert mesh.centre == pytest.approx((5, 5, 5))
    assert mesh.scale == pytest.approx(2)
    assert turned.centre == pytest.approx((5, 7, -6))
    assert (mesh.coloured, cloud.coloured) == (False, True)
    for shape in (mesh, cloud):
        np.testing.assert_allclose(shape.distance(np.array([[0, 0, 0.9], [0, 0, 1.5]])), [-0.1, 0.5], atol=0.01)


def test_a_callback_may_end_a_training() -> None:
    def callback(stage: str, fraction: float, loss: float) -> None:
        if fraction > 0.2:
            raise KeyboardInterrupt

    field = mplicits.train("demo", "8x0", steps=40, texture="none", quiet=True, callback=callback)
    assert field.model.provenance["interrupted"]


def test_what_cannot_be_trained_is_refused() -> None:
    vertices = trimesh.creation.icosphere(1).vertices
    for shape, said in (
        ((vertices, np.array([[0, 1, 99]])), "faces of vertices that are not there"),
        ((vertices, np.array([[0, 1]])), r"\(F, 3\) is needed"),
        ((vertices, vertices[:5]), "differ in number"),
        ((vertices[:, :2], vertices), r"\(N, 3\) is needed"),
        (vertices, "a shape is a file"),
    ):
        with pytest.raises(mplicits.UserError, match=said):
            mplicits.train(shape, "8x0", steps=1, quiet=True)
    for options, said in (
        ({"preset": "large"}, "--preset large"),
        ({"device": "tpu"}, "--device tpu"),
        ({"up": "w"}, "up: 'w' is none of"),
        ({"seconds": 5, "steps": 5}, "--steps: not allowed with --seconds"),
        ({"weights": {"value": -1.0}}, "must not be negative"),
        ({"omega": [30.0, 60.0, 90.0]}, "--omega"),
    ):
        with pytest.raises(mplicits.UserError, match=said):
            mplicits.train("demo", **{"levels": "8x0"} | options)
