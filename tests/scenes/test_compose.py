"""Scenes: their field is the numpy composition of their shapes', and what is wrong with their files is one line."""

import re
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

import mplicits
from mplicits import cli
from mplicits.field import composed as reference
from mplicits.field import interpret
from mplicits.field.run import run
from mplicits.ir.at_time import at_time
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.expression_reader import read
from mplicits.model.model_file import load, save, to_bytes
from mplicits.model.scene import Disc, from_json, shapes_of
from oracles.march import march
from support.paths import ROOT
from support.scene_models import SCENE, composed, write_balls

Values = NDArray[np.float64]
OFFSET = 1.3


def ball_values(field: mplicits.Field, points: Values, margin: float) -> Values:
    """What ir/composition.py says of one shape, by the levels of its own model."""
    far = np.linalg.norm(points, axis=1)
    inside = (points / np.maximum(far, 1)[:, None]).astype(np.float32)
    program = lower(field.model)
    f = interpret.field(program, inside, 1).astype(np.float64)
    if len(field.levels) > 1:
        delta = field.model.levels[0].delta
        residual = interpret.field(program, inside, 2).astype(np.float64) - f
        f = f + np.clip((delta - np.abs(f)) / (delta - delta / OFFSET), 0, 1) * residual
    outside = far - 1
    asked = np.where(outside > 0, np.hypot(outside, np.maximum(f, 0)), f)
    return np.where(outside < margin, asked, outside)


def expected(folder: Path, model: mplicits.Field, points: Values, t: float) -> Values:
    """SCENE's field at points in model space, put together by hand."""
    ball, coarse = (mplicits.load(folder / name) for name in ("ball.safetensors", "coarse.safetensors"))
    x = points * model.model.scale + np.array(model.model.center)
    axis, angle = np.array([0, 1, 1]) / np.sqrt(2), np.radians(90 * t)
    q = x - [-1.2, 0.3 * t, 0]
    along = (q @ axis)[:, None] * axis
    q = along + np.cos(angle) * (q - along) - np.sin(angle) * np.cross(axis, q)
    first = ball_values(ball, q, 0.1)
    y = x - [0.9, 0, 0]
    a = ball_values(ball, y, 0.3)
    b = 0.6 * ball_values(coarse, (y - [0.2, 0.9, 0]) / 0.6, 0.5)
    h = np.clip(0.5 + (b - a) / 0.6, 0, 1)
    second = h * a + (1 - h) * b - 0.3 * h * (1 - h)
    z, scale = x - [0, 0, -1.9], 0.7 + 0.1 * t
    third = np.maximum(ball_values(ball, z, 0.1), -scale * ball_values(ball, (z - [0.2, 0.5, 0.5]) / scale, 0.1))
    assert model.model.scene is not None
    (disc,) = (part for part in shapes_of(model.model.scene) if isinstance(part, Disc))
    unit = disc.placement.scale.at(0)
    p = (x - [0, -1, 0]) / unit
    beside, above = np.hypot(p[:, 0], p[:, 2]) - disc.radius, abs(p[:, 1] + disc.thickness / 2) - disc.thickness / 2
    plate = unit * (np.minimum(np.maximum(beside, above), 0) + np.hypot(np.maximum(beside, 0), np.maximum(above, 0)))
    return np.asarray(np.minimum.reduce([first, second, third, plate]) / model.model.scale)


def test_the_field_is_the_composition_by_hand(tmp_path: Path) -> None:
    model = composed(tmp_path)
    field, points = mplicits.Field(model), np.random.default_rng(0).uniform(-0.8, 0.8, (20_000, 3))
    assert model.inputs == "xyzt"
    ball = mplicits.load(tmp_path / "ball.safetensors").model
    assert len(model.levels) == 2
    assert model.levels[0].delta == pytest.approx(ball.levels[0].delta / model.scale)
    for time in (0.0, 0.7):
        value, reached = interpret.nested_field(lower(model), points.astype(np.float32), 2, time)
        by_hand = expected(tmp_path, field, points.astype(np.float32).astype(np.float64), time)
        assert (reached == 2).sum() > 500
        near = reached == 2
        np.testing.assert_allclose(value[near], by_hand[near], rtol=0, atol=1e-6)
        np.testing.assert_allclose(field.sdf(points, time=time), value, rtol=0, atol=1e-6)
        frozen, _ = interpret.nested_field(at_time(lower(model), time), points.astype(np.float32), 2)
        np.testing.assert_allclose(frozen, value, rtol=0, atol=1e-6)


def test_its_gradient_is_that_of_the_field(tmp_path: Path) -> None:
    program = lower(composed(tmp_path))
    points = np.random.default_rng(1).uniform(-0.7, 0.7, (20_000, 3)).astype(np.float32)
    gradient, value = interpret.field_gradient(program, points, 2, 0.4)
    here, _ = interpret.nested_field(program, points, 2, 0.4)
    np.testing.assert_array_equal(value, here)
    step = 1e-3
    sides = [
        [
            interpret.nested_field(program, (points + side * step * axis).astype(np.float32), 2, 0.4)[0]
            for axis in np.eye(3)
        ]
        for side in (-1, 1)
    ]
    slopes = (np.array(sides[1]) - np.array(sides[0])).T / (2 * step)
    apart = np.linalg.norm(slopes - gradient, axis=1)
    assert np.percentile(apart, 90) < 2e-3
    assert (apart > 0.1).mean() < 0.03, "where shapes meet, at rims and at the edges of what a network is asked"


def test_colors_travel_with_their_shapes(tmp_path: Path) -> None:
    text = (
        'parts = [{ model = "ball.safetensors", translate = [-2, 0, 0] }, { model = "coarse.safetensors" }]\n'
        "[ground]\ncolor = [0.1, 0.2, 0.3]\n"
    )
    model = composed(tmp_path, text)
    field, ball = mplicits.Field(model), mplicits.load(tmp_path / "ball.safetensors")
    on_ball = np.random.default_rng(2).normal(size=(500, 3))
    on_ball *= 0.7 / np.linalg.norm(on_ball, axis=1)[:, None]
    colors = field.color((on_ball + np.array([-2, 0, 0]) - model.center) / model.scale)
    np.testing.assert_allclose(colors, ball.color(on_ball), rtol=0, atol=1e-4)
    np.testing.assert_allclose(field.color((np.zeros(3) - model.center) / model.scale), (0.8, 0.74, 0.66), atol=1e-6)
    below = np.array([0.5, -1.2, 0.5]) - model.center
    np.testing.assert_allclose(field.color(below / model.scale), (0.1, 0.2, 0.3), atol=1e-6)


def test_rays_ask_only_the_shapes_that_they_come_near(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = '[[parts]]\nmodel = "ball.safetensors"\ntranslate = [{}, 0, 0]\n'
    several = composed(tmp_path, "".join(part.format(x) for x in (-2.5, 0, 2.5)))
    alone = composed(tmp_path, part.format(-2.5))
    asked = [0]

    def counted(program: object, function: object, inputs: NDArray[np.float32]) -> object:
        asked[0] += len(inputs)
        return run(program, function, inputs)  # type: ignore[arg-type]

    monkeypatch.setattr(reference, "run", counted)
    eye = np.array([-2.5, 0.0, 8.0])
    rays = np.random.default_rng(3).uniform(-0.9, 0.9, (2000, 3)) * (1, 1, 0) + (-2.5, 0, 0) - eye
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    counts = []
    for model in (several, alone):
        asked[0] = 0
        traced = march(lower(model), (eye - model.center) / model.scale, rays, 2, 0.002 / model.scale)
        assert traced.hit.sum() > 800
        counts.append(asked[0])
    assert counts[0] <= 1.5 * counts[1]


def test_tensors_give_tensors_that_are_differentiable(tmp_path: Path) -> None:
    field = mplicits.Field(composed(tmp_path))
    array = np.random.default_rng(2).uniform(-0.8, 0.8, (2000, 3)).astype(np.float32)
    points = torch.from_numpy(array).requires_grad_()
    value = field(points, time=0.3)
    np.testing.assert_array_equal(value.detach(), field(array, time=0.3))
    (gradient,) = torch.autograd.grad((2 * value).sum(), points)
    np.testing.assert_allclose(gradient, 2 * field.gradient(array, time=0.3), atol=1e-6)
    np.testing.assert_array_equal(field.gradient(points, time=0.3), gradient / 2)
    np.testing.assert_array_equal(field.color(points.detach(), time=0.3), field.color(array, time=0.3))
    with pytest.raises(UserError, match="differentiable once"):
        torch.autograd.grad(field(points).sum(), points, create_graph=True)


def test_the_file_holds_the_scene_and_older_ones_are_written_as_before(tmp_path: Path) -> None:
    model = composed(tmp_path)
    save(model, tmp_path / "m.safetensors")
    again = load(tmp_path / "m.safetensors")
    assert again.sha256() == model.sha256()
    assert again.scene == model.scene
    assert to_bytes(again) == to_bytes(model)
    assert b'"version":"2"' in to_bytes(model)
    assert b'"version":"1"' in (tmp_path / "ball.safetensors").read_bytes()
    nested = composed(tmp_path, '[[parts]]\nmodel = "m.safetensors"\nscale = 2\n')
    points = np.random.default_rng(4).uniform(-0.5, 0.5, (500, 3))
    there = mplicits.Field(model).sdf((points * nested.scale + nested.center) / 2, time=0.6)
    value = mplicits.Field(nested).sdf(points, time=0.6)
    np.testing.assert_allclose(value * nested.scale, 2 * there, rtol=0, atol=1e-5)


def test_scenes_hold_scenes(tmp_path: Path) -> None:
    write_balls(tmp_path)
    (tmp_path / "inner.toml").write_text(SCENE.partition("[ground]")[0])
    (tmp_path / "outer.toml").write_text('[[parts]]\nmodel = "inner.toml"\nscale = 0.5\n')
    inner, outer = (mplicits.compose(tmp_path / name) for name in ("inner.toml", "outer.toml"))
    points = np.random.default_rng(5).uniform(-0.5, 0.5, (500, 3))
    np.testing.assert_allclose(outer.sdf(points, time=0.3), inner.sdf(points, time=0.3), rtol=0, atol=2e-5)


PART = '[[parts]]\nmodel = "ball.safetensors"\n'
BAD = (
    ('[[parts]]\nmodel = "none.safetensors"\n', "2: parts[1].model: none.safetensors: no such file"),
    (PART + "size = 2\n", "3: parts[1].size: unknown key"),
    ("colour = 1\n" + PART, "1: colour: unknown key"),
    (PART + "scale = 0\n", "3: parts[1].scale: must be positive"),
    (PART + 'scale = "t - 0.5"\n', "3: parts[1].scale: must be positive"),
    (PART + PART + '\nangle = "1 / (t - 0.5)"\n', "6: parts[2].angle: (t - 0.5) divides by zero at t = 0.5"),
    (PART + 'translate = [0, "x", 0]\n', "3: parts[1].translate: x: x is none of t"),
    (PART + "translate = [0, 0]\n", "3: parts[1].translate: three numbers"),
    (PART + "axis = [0, 0, 0]\n", "3: parts[1].axis: its length"),
    ('operation = "xor"\n' + PART, "1: operation: choose one of union"),
    ('operation = "smooth union"\n' + PART, "1: radius: must be positive"),
    ('[[parts]]\nmodel = "scene.toml"\n', "2: parts[1].model: scene.toml is a scene that contains itself"),
    ("name = 3\n" + PART, "1: name: a text"),
    ("", "1: parts: a scene has [[parts]]"),
    (PART + "[ground]\nradius = -1\n", "4: ground.radius: must be positive"),
    (PART + "[[parts]]\n[[parts.parts]]\ntime = 1\n", "4: parts[2].parts[1].model: a part has a model"),
    ("[[parts]\n", " not TOML"),
)


@pytest.mark.parametrize(("text", "said"), BAD)
def test_a_bad_scene_is_one_line_with_file_line_and_key(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UserError, match=re.escape(f"scene.toml:{said}")) as caught:
        composed(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_verb_and_function_make_one_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = composed(tmp_path)
    path = tmp_path / "m.safetensors"
    assert cli.main(["compose", str(tmp_path / "scene.toml"), "-o", str(path)]) == 0
    assert "6 shapes of 2 models, moving" in capsys.readouterr().err
    assert load(path).sha256() == model.sha256() == mplicits.compose(tmp_path / "scene.toml").model.sha256()
    assert cli.main(["info", str(path)]) == 0
    assert "a scene of" in capsys.readouterr().out
    mesh = mplicits.load(path).mesh(48, time=0.5, quiet=True)
    assert mesh.to_trimesh().is_watertight
    assert mesh.colors is not None
    assert np.abs(mplicits.load(path).sdf(mesh.vertices, space="input", time=0.5)).max() < 0.1


def test_the_example_shows_its_shapes_where_it_says() -> None:
    field = mplicits.compose(ROOT / "examples" / "pond.toml")
    assert len(field.model.shapes) == 4
    spot, duck = (-0.75, 0.0, -0.15), (0.35 + 0.62 * 0.55, -0.42, 0.95)
    assert field(spot, space="input") < 0
    times = [float(field(duck, space="input", time=t)) for t in np.linspace(0, 1, 9)]
    assert min(times) < 0 < max(times), "the ring turns through this point"
    assert times[0] == pytest.approx(times[-1], abs=1e-6)


DEEP = "".join(f"[[{'.'.join(['parts'] * depth)}]]\n" for depth in range(1, 16)) + 'model = "spot-small"\n'
EDGES = (
    DEEP,
    'parts = [{ model = "spot-small", translate = ["1e6*t", 0, 0] }, { model = "spot-small" }]\n',
    '[[parts]]\nmodel = "spot-small"\n[ground]\nradius = 1e-5\nthickness = 1e-6\n',
    '[[parts]]\nmodel = "spot-small"\n[ground]\nradius = 1e5\n',
    '[[parts]]\nmodel = "spot-small"\n[ground]\nheight = 999999\n',
    'operation = "smooth union"\nradius = 1e6\nparts = [{ model = "spot-small" }, { model = "bob-small" }]\n',
    '[[parts]]\nmodel = "spot-small"\nscale = 1e-5\n',
)


@pytest.mark.parametrize("text", EDGES)
def test_what_compose_writes_is_read_again(text: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(text)
    model = mplicits.compose(tmp_path / "scene.toml").model
    save(model, tmp_path / "m.safetensors")
    assert load(tmp_path / "m.safetensors").sha256() == model.sha256()
    values = interpret.nested_field(lower(model), np.zeros((3, 3), np.float32), len(model.levels), 0.5)[0]
    assert np.isfinite(values).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PART + 'angle = "min(1e300, t)"\n', "3: parts[1].angle: 1e+300 is too large for 32 bits"),
        (PART + 'angle = "t * (1e30*1e30/1e60)"\n', "3: parts[1].angle: (1e+30 * 1e+30) is too large for 32 bits"),
        (PART + 'angle = "t / 1e-40"\n', "3: parts[1].angle: 1e-40 is too small for 32 bits"),
        (PART + 'angle = "min(t * 1e-20 * 1e-20, 1)"\n', "is too small for 32 bits"),
        (PART + "[ground]\nradius = 1e-30\n", "4: ground.radius: must be positive"),
        (PART + "translate = [1e6, 0, 0]\nscale = 1e-3\n", "the scene's radius is"),
        (
            PART + "[[parts]]\nscale = 1e-4\n[[parts.parts]]\nscale = 1e-4\n" + PART[10:],
            "in the whole scene, less than",
        ),
    ],
)
def test_what_a_target_cannot_say_is_refused_by_compose(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=re.escape(said)) as caught:
        composed(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_long_files_are_refused_at_once(tmp_path: Path) -> None:
    """30,000 references to a scene of many shapes, and a line of a million spaces before an unknown key."""
    began = process_time()
    many = "parts = [" + '{ model = "ball.safetensors" },' * 64 + "]\n"
    write_balls(tmp_path)
    (tmp_path / "many.toml").write_text(many)
    for text, said in (
        ('[[parts]]\nmodel="many.toml"\n' * 30_000, "more than 64 shapes"),
        (PART + " " * 900_000 + "wrong = 1\n", "3: parts[1].wrong: unknown key"),
    ):
        (tmp_path / "scene.toml").write_text(text)
        with pytest.raises(UserError, match=re.escape(said)):
            mplicits.compose(tmp_path / "scene.toml")
    assert process_time() < began + 10


def test_compose_never_overwrites_a_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_balls(tmp_path)
    (tmp_path / "inner.toml").write_text(PART)
    (tmp_path / "scene.toml").write_text('[[parts]]\nmodel = "inner.toml"\n')
    ball = (tmp_path / "ball.safetensors").read_bytes()
    for name, force in (("ball.safetensors", []), ("ball.safetensors", ["--force"]), ("inner.toml", ["--force"])):
        before = (tmp_path / name).read_bytes()
        assert cli.main(["compose", str(tmp_path / "scene.toml"), "-o", str(tmp_path / name), *force]) == 2
        assert "it is the input" in capsys.readouterr().err
        assert (tmp_path / name).read_bytes() == before
    assert (tmp_path / "ball.safetensors").read_bytes() == ball


def test_a_model_elsewhere_needs_follow(tmp_path: Path) -> None:
    write_balls(tmp_path)
    (inside := tmp_path / "inside").mkdir()
    (inside / "scene.toml").write_text(PART.replace("ball.safetensors", "../ball.safetensors"))
    with pytest.raises(UserError, match=r"outside of the folder; --follow reads it"):
        mplicits.compose(inside / "scene.toml")
    assert mplicits.compose(inside / "scene.toml", follow=True).model.scene is not None


@pytest.mark.parametrize("text", ["a" + ".a" * 20_000 + " = 1\n", "[a" + ".a" * 2000 + "]\n" + "b = 1\n" * 100_000])
def test_long_keys_are_refused_at_once(text: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(text)
    began = process_time()
    with pytest.raises(UserError, match=r"a line with 20?,000 dots; write shorter lines"):
        mplicits.compose(tmp_path / "scene.toml")
    assert process_time() - began < 1


def test_an_inner_scene_is_parsed_once(tmp_path: Path) -> None:
    (tmp_path / "inner.toml").write_text("#\n" * 100_000 + '[[parts]]\nmodel = "spot-small"\n')
    (tmp_path / "scene.toml").write_text('[[parts]]\nmodel = "inner.toml"\n' * 60)
    began = process_time()
    root = mplicits.compose(tmp_path / "scene.toml").model.scene
    assert root is not None
    assert sum(1 for _ in shapes_of(root)) == 60
    assert process_time() - began < 3


def test_many_formulas_and_shapes_are_refused_before_they_are_read(tmp_path: Path) -> None:
    formula = "t" + " / (t * 1e4 - t * 1e4 + 9)" * 4
    began = process_time()
    with pytest.raises(UserError, match="parts: more than 10,000 characters of formulas"):
        composed(tmp_path, f"{PART}angle = '{formula}'\n" * 200)
    parts = [{"model": 0, "angle": f"t * {k}"} for k in range(20_000)]
    with pytest.raises(UserError, match="scene: more than 64 shapes"):
        from_json({"parts": parts}, 1)
    parts = [{"model": 0, "angle": formula, "scale": formula, "time": formula} for _ in range(64)]
    with pytest.raises(UserError, match="scene: more than 10,000 characters of formulas"):
        from_json({"parts": parts}, 1)
    assert process_time() - began < 3


def test_a_division_in_doubt_everywhere_is_refused() -> None:
    with pytest.raises(UserError, match="divides by zero"):
        read("1 / (t*1e6 - t*1e6 + t - 0.9)")
