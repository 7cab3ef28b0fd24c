"""`import mplicits`: the modules that it loads; Field against the NumPy reference, PyTorch and itself."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from inspect import getmembers, isfunction, signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

import mplicits
from mplicits.api import functions
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.orientation import as_in_file
from mplicits.trainer.networks import torch_field
from support.paths import DEMO, ROOT
from support.random_model import random_model

IMPORTED = """
import json, sys, time
began = time.process_time()
import mplicits
print(json.dumps([time.process_time() - began, *sys.modules]))
"""
LIGHT = 0.1
"""Seconds that importing may take."""
MODEL = random_model((16, 1), (18, 2), (24, 1), texture=(10, 1))
FIELD = mplicits.Field(MODEL)
PLACED = mplicits.Field(replace(MODEL, center=(10.0, -20.0, 5.0), scale=3.0, up="z"))
"""The same model, of a file in other coordinates."""
MOVING = random_model((16, 1), (18, 1), texture=(10, 1), inputs="xyzt")


def points(*shape: int) -> NDArray[np.float32]:
    return np.random.default_rng(2).uniform(-1, 1, (*shape, 3)).astype(np.float32)


def in_file(model_space: NDArray[np.floating]) -> NDArray[np.float64]:
    """The coordinates in PLACED's file of points in model space."""
    return as_in_file(model_space.astype(np.float64) * 3.0 + (10.0, -20.0, 5.0), "z")


def test_importing_loads_nothing_heavy_and_is_quick() -> None:
    command = [sys.executable, "-c", IMPORTED]
    done = [subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True) for _ in range(2)]
    results = [json.loads(process.stdout) for process in done]
    assert not {"numpy", "torch", "moderngl", "trimesh", "igl", "PIL", "safetensors"} & set(results[0][1:])
    assert min(seconds for seconds, *_ in results) < LIGHT


def test_every_public_name_can_be_imported() -> None:
    assert set(mplicits.__all__) <= set(dir(mplicits))
    assert all(getattr(mplicits, name).__name__ == name for name in mplicits.__all__)
    with pytest.raises(AttributeError, match="no attribute 'laod'"):
        mplicits.laod  # noqa: B018


def test_no_public_signature_has_any() -> None:
    public = getmembers(mplicits.Field, isfunction)
    public += [pair for pair in getmembers(functions, isfunction) if pair[1].__module__ == functions.__name__]
    assert len(public) > 20
    for name, member in public:
        public_signature = signature(member)
        hints = [
            public_signature.return_annotation,
            *(each.annotation for each in public_signature.parameters.values() if each.name != "self"),
        ]
        # NumPy itself writes the shape of an array of any shape as tuple[Any, ...].
        texts = [str(hint).replace("tuple[typing.Any, ...]", "") for hint in hints]
        assert not [text for text in texts if "Any" in text or "inspect._empty" in text], name


def test_models_are_loaded_by_name_path_and_bytes() -> None:
    named, path, data = mplicits.load("spot"), mplicits.load(DEMO), mplicits.load(DEMO.read_bytes())
    assert repr(named) == "<mplicits.Field 'spot': 64x1 > 64x2, colors by 64x2, 21,893 parameters>"
    assert (named.levels, named.parameters) == (("64x1", "64x2"), 21_893)
    assert path.model.sha256() == data.model.sha256()
    for source, message in ((b"text", "these bytes: not a model file"), ("spto", "did you mean 'spot'")):
        with pytest.raises(mplicits.UserError, match=message):
            mplicits.load(source)


@pytest.mark.parametrize("level", [1, 2, None])
def test_a_field_equals_the_reference(level: int | None) -> None:
    many = points(10_000)
    assert len(many) > FIELD._evaluator._chunk, "several chunks, in several threads"
    expected, reached = interpret.nested_field(lower(MODEL), many, level or 3)
    np.testing.assert_allclose(FIELD.sdf(many, level), expected, atol=2e-6)
    gradients = FIELD.gradient(many, level)
    for number in range(1, (level or 3) + 1):
        there = reached == number
        theirs, _ = interpret.field_gradient(lower(MODEL), many[there], number)
        np.testing.assert_allclose(gradients[there], theirs, atol=2e-5)
    np.testing.assert_allclose(FIELD.color(many), interpret.color(lower(MODEL), many), atol=2e-6)


def test_points_have_any_shape() -> None:
    grid = points(4, 5, 6)
    rows = FIELD(grid.reshape(-1, 3))
    assert rows.dtype == np.float32
    np.testing.assert_array_equal(FIELD(grid), rows.reshape(4, 5, 6))
    np.testing.assert_allclose(FIELD(grid.tolist()), rows.reshape(4, 5, 6), atol=1e-6)
    assert FIELD([0, 0, 0]).shape == ()
    assert FIELD(np.zeros((0, 3))).shape == (0,)
    assert (FIELD.gradient(grid).shape, FIELD.color([[0, 0, 1]]).shape) == ((4, 5, 6, 3), (1, 3))
    with pytest.raises(mplicits.UserError, match="level 4: the model has levels 1 to 3"):
        FIELD(grid, 4)
    with pytest.raises(mplicits.UserError, match="space 'file' is none of model, input"):
        FIELD(grid, space="file")


def test_spaces_are_one_shape() -> None:
    here = points(500)
    np.testing.assert_allclose(PLACED.sdf(in_file(here), space="input"), 3.0 * FIELD.sdf(here), atol=5e-6)
    turned = as_in_file(FIELD.gradient(here).astype(np.float64), "z")
    np.testing.assert_allclose(PLACED.gradient(in_file(here), space="input"), turned, atol=5e-5)
    np.testing.assert_allclose(PLACED.color(in_file(here), space="input"), FIELD.color(here), atol=5e-6)
    there = torch.tensor(in_file(here), requires_grad=True)
    value = PLACED.sdf(there, space="input")
    np.testing.assert_allclose(value.detach(), 3.0 * FIELD.sdf(here), atol=5e-6)
    value.sum().backward()  # type: ignore[no-untyped-call]
    assert there.grad is not None
    np.testing.assert_allclose(there.grad, turned, atol=5e-5)
    np.testing.assert_allclose(PLACED.gradient(there, space="input").detach(), turned, atol=5e-5)


def test_tensors_give_tensors_that_are_differentiable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch_field, "CHUNK", 64)
    array = points(20, 10)
    tensor = torch.from_numpy(array)
    value = FIELD(tensor)
    assert (value.dtype, value.requires_grad) == (torch.float32, False)
    np.testing.assert_allclose(value, FIELD(array), atol=2e-6)
    np.testing.assert_allclose(FIELD.gradient(tensor), FIELD.gradient(array), atol=2e-5)
    np.testing.assert_allclose(FIELD.color(tensor), FIELD.color(array), atol=2e-6)
    leaf = tensor.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(FIELD(leaf, 2).sum(), leaf, create_graph=True)
    np.testing.assert_allclose(gradient.detach(), FIELD.gradient(array, 2), atol=2e-5)
    (eikonal,) = torch.autograd.grad((gradient.norm(dim=-1) - 1).square().sum(), leaf)
    again = tensor.clone().requires_grad_()
    (FIELD.gradient(again, 2).norm(dim=-1) - 1).square().sum().backward()
    assert again.grad is not None
    np.testing.assert_allclose(again.grad, eikonal, atol=1e-4)
    assert eikonal.abs().max() > 0.1


def test_a_model_that_moves_takes_a_time() -> None:
    field, here = mplicits.Field(MOVING), points(300)
    for time in (0.0, 0.7):
        expected, _ = interpret.nested_field(lower(MOVING), here, 2, time)
        np.testing.assert_allclose(field(here, time=time), expected, atol=2e-6)
        np.testing.assert_allclose(field(torch.from_numpy(here), time=time), expected, atol=2e-6)
        np.testing.assert_allclose(field.color(here, time=time), interpret.color(lower(MOVING), here, time), atol=2e-6)
    step = 1e-2
    right = np.array([step, 0, 0], np.float32)
    slope = (field(here + right, 1, time=0.7) - field(here - right, 1, time=0.7)) / (2 * step)
    np.testing.assert_allclose(field.gradient(here, 1, time=0.7)[:, 0], slope, atol=0.02)
    assert field.bounds.tolist() == [[-1] * 3, [1] * 3]


def test_a_model_without_texture_has_the_plain_color() -> None:
    plain = mplicits.Field(random_model((4, 0)))
    np.testing.assert_allclose(plain.color(points(2, 3)), np.full((2, 3, 3), [0.80, 0.74, 0.66]), atol=1e-6)
    np.testing.assert_allclose(plain.color(torch.zeros(3)), [0.80, 0.74, 0.66], atol=1e-6)


@pytest.mark.parametrize("moving", [False, True])
def test_threads_share_a_field(moving: bool) -> None:
    """Eight threads ask different questions at once; each answer is that of a thread alone."""
    field, time = (mplicits.Field(MOVING), 0.3) if moving else (FIELD, 0.0)
    many, eye = points(8, 6000), np.array([0.0, 0.0, 3.0])

    def ask(number: int) -> list[NDArray[np.float32]]:
        here = many[number % 8]
        tensor = torch.from_numpy(here[:500])
        with torch.no_grad():
            of_tensor = field(tensor, time=time), field.gradient(tensor, time=time)
        return [
            field(here, time=time),
            field(here, 1, time=time),
            field.gradient(here, time=time),
            field.color(here, time=time),
            field.trace(eye, here[:400] - eye, time=time).points,
            *(result.numpy() for result in of_tensor),
        ]

    expected = [ask(number) for number in range(8)]
    field = mplicits.Field(field.model)  # what a field makes at its first question, threads make at once
    with ThreadPoolExecutor(8) as pool:
        for number, results in enumerate(pool.map(ask, range(24))):
            for result, right in zip(results, expected[number % 8], strict=True):
                np.testing.assert_allclose(result, right, atol=1e-5)


def test_rays_end_where_the_field_is_zero() -> None:
    spot = mplicits.load("spot")
    rng = np.random.default_rng(3)
    eye = np.array([0.3, 0.5, 2.5])
    hits = spot.trace(eye, rng.normal(0, 0.5, (40, 50, 3)) - eye)
    assert hits.hit.shape == (40, 50)
    assert 0.3 < hits.hit.mean() < 1
    np.testing.assert_allclose(spot(hits.points[hits.hit]), 0, atol=3e-6)
    gradient = spot.gradient(hits.points[hits.hit])
    lengths = np.linalg.norm(gradient, axis=-1, keepdims=True)
    np.testing.assert_allclose(hits.normals[hits.hit], gradient / lengths, atol=1e-5)
    before = eye + np.linspace(0, 0.999, 50)[:, None, None] * (hits.points[hits.hit] - eye)
    assert (spot(before) > 0).all(), "nothing is met earlier"
    np.testing.assert_allclose(np.linalg.norm(hits.points - eye, axis=-1)[hits.hit], hits.t[hits.hit], rtol=1e-6)
    assert np.isinf(hits.t[~hits.hit]).all()
    assert np.isnan(hits.points[~hits.hit]).all()
    assert repr(hits) == f"<mplicits.Hits: {hits.hit.sum():,} of 2,000 rays>"


def test_rays_from_inside_and_from_the_file_s_space() -> None:
    model = mplicits.load("spot").model
    spot, placed = mplicits.Field(model), mplicits.Field(replace(model, center=(10.0, -20.0, 5.0), scale=3.0, up="z"))
    assert spot.trace([0.1, 0, 0], [0, 0, 5]).t == 0
    here, along = np.array([0.2, 0.1, 3.0]), np.array([0.0, 0.0, -2.0])
    model_hit, hit = spot.trace(here, along), placed.trace(in_file(here), as_in_file(along, "z"), space="input")
    np.testing.assert_allclose(hit.t, 3 * model_hit.t, rtol=1e-6)
    np.testing.assert_allclose(hit.points, in_file(model_hit.points), rtol=1e-6)
    np.testing.assert_allclose(hit.normals, as_in_file(model_hit.normals.astype(float), "z"), atol=1e-5)
    with pytest.raises(mplicits.UserError, match="length 0"):
        spot.trace([0, 0, 2], [0, 0, 0])


def test_bounds_are_tight() -> None:
    spot = mplicits.load("spot")
    vertices = spot.mesh(48, space="model", quiet=True).vertices
    low, high = spot.bounds
    assert (low <= vertices.min(axis=0)).all()
    assert (high >= vertices.max(axis=0)).all()
    assert np.abs(spot.bounds - [vertices.min(axis=0), vertices.max(axis=0)]).max() < 0.1


def test_no_other_file_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(mplicits.UserError, match="not a model"):
        FIELD.save(tmp_path / "notes.txt")


def test_times_and_levels_are_checked_as_on_the_command_line() -> None:
    moving, here = mplicits.Field(MOVING), points(4)
    times: tuple[Any, ...] = (2, -0.1, np.nan, np.inf, "0.5", None, True, 1j, [0.5], 10**400)
    levels: tuple[Any, ...] = (0, 4, 1.0, "1", True, [1], np.nan, 10**400)
    calls: tuple[Any, ...] = (moving.sdf, moving.gradient, moving.color)
    for wrong in times:
        for call in calls:
            with pytest.raises(mplicits.UserError, match=r"^time "):
                call(here, time=wrong)
        with pytest.raises(mplicits.UserError, match=r"^time "):
            moving.trace(here, here, time=wrong)
    half: Any = np.array(0.5)
    np.testing.assert_array_equal(moving(here, time=half), moving(here, time=0.5))
    with pytest.raises(mplicits.UserError, match=r"time 0.5: this model does not move"):
        FIELD(torch.from_numpy(here), time=0.5)
    for wrong in levels:
        with pytest.raises(mplicits.UserError, match=r"^level .*: the model has levels 1 to 3"):
            FIELD(here, wrong)
        with pytest.raises(mplicits.UserError, match=r"^level .*: the model has levels 1 to 3"):
            FIELD(torch.from_numpy(here), wrong)
    second: Any = np.array(2)
    np.testing.assert_array_equal(FIELD(here, second), FIELD(here, 2))


def test_origins_and_directions_are_numbers_that_fit() -> None:
    here = points(4)
    tensor = torch.from_numpy(here)
    with pytest.raises(mplicits.UserError, match=r"origins: the tensor requires gradients"):
        FIELD.trace(tensor.clone().requires_grad_(), here)  # type: ignore[arg-type]
    with pytest.raises(mplicits.UserError, match=r"origins and directions: .*\(4, 3\) and \(3, 3\)"):
        FIELD.trace(here, here[:3])
    traced = FIELD.trace(tensor.bfloat16(), here)  # type: ignore[arg-type]
    np.testing.assert_array_equal(traced.t, FIELD.trace(tensor.bfloat16().float().numpy(), here).t)


def test_tensors_of_other_types_and_of_inference_mode_are_evaluated() -> None:
    here = torch.from_numpy(points(50))
    field = mplicits.Field(MODEL)
    with torch.inference_mode():
        made = here.clone()
        np.testing.assert_allclose(field.gradient(made), FIELD.gradient(here), atol=2e-5)
        np.testing.assert_allclose(field(made), FIELD(here), atol=2e-6)
    np.testing.assert_allclose(field.gradient(made), FIELD.gradient(here), atol=2e-5)
    leaf = here.clone().requires_grad_()
    assert torch.autograd.grad(field(leaf).sum(), leaf)[0].isfinite().all(), "weights that inference mode did not make"
    plain = mplicits.Field(random_model((4, 0)))
    for other in (here.bfloat16(), here.half(), here.double(), (3 * here).int()):
        assert field(other).dtype == torch.float32
        np.testing.assert_allclose(field(other), FIELD(other.float()), atol=2e-6)
        np.testing.assert_allclose(plain.color(other), plain.color(here.numpy()), atol=1e-6)


def test_options_have_the_types_of_the_command_line() -> None:
    for name, wrong in (
        ("size", (0.5, 3)),
        ("size", True),
        ("camera", "30,20"),
        ("camera", (1.0,)),
        ("level", 1.0),
        ("samples", "4"),
        ("light", (1, 2)),
        ("transparent", "no"),
        ("shade", ["phong"]),
        ("fov", 10**400),
    ):
        with pytest.raises(mplicits.UserError, match=rf"^--{name} "):
            FIELD.render(**{name: wrong})  # type: ignore[arg-type]
    with pytest.raises(mplicits.UserError, match="size 0x0"):
        FIELD.render(size=0)
    with pytest.raises(mplicits.UserError, match=r"--resolution 64\.0: a whole number is needed"):
        FIELD.mesh(resolution=64.0)  # type: ignore[arg-type]
    with pytest.raises(mplicits.UserError, match=r"--target x: choose"):
        FIELD.bake(target="x")
    sixteen: Any = np.int64(16)
    assert len(FIELD.mesh(resolution=sixteen, quiet=True).vertices)
    with pytest.raises(mplicits.UserError, match="checkpoints: name one file or more"):
        mplicits.import_checkpoints([])
    with pytest.raises(mplicits.UserError, match=r"missing.pth: no such file"):
        mplicits.import_checkpoints("missing.pth")


@pytest.mark.parametrize("value", [None, 5, 1.5, b"x", [], "a\0b", np.zeros(3)])
def test_what_is_no_path_is_refused_by_the_argument_s_name(value: Any) -> None:
    for call, message in (
        (mplicits.compose, "scene .*: a path is needed"),
        (mplicits.photos, "folder .*: a path is needed"),
        (FIELD.evaluate, "shape .*: a path is needed"),
        (mplicits.import_checkpoints, "checkpoints( .*: a path is needed|: name one file)"),
        (FIELD.save, "path .*: a path is needed"),
        (mplicits.Field, "model .*: mplicits.load and mplicits.train make a Field"),
    ):
        with pytest.raises(mplicits.UserError, match=f"^{message}"):
            call(value)
    if value is not None:
        with pytest.raises(mplicits.UserError, match=r"^log .*: a path is needed"):
            mplicits.report(FIELD, log=value)


def test_numbers_that_no_float_holds_are_refused() -> None:
    huge: Any = [[10**400, 0, 0]]
    half: Any = Fraction(1, 2)
    with pytest.raises(mplicits.UserError, match=r"^points: real numbers"):
        FIELD(huge)
    with pytest.raises(mplicits.UserError, match=r"^time 1/2: this model does not move"):
        FIELD([0, 0, 0], time=half)
