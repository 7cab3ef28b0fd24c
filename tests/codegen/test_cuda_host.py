"""The CUDA file compiled for the host (tests/support/cuda_on_host/): field, march, queues, tiles, errors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.codegen.targets.glsl330 import bake
from mplicits.field import interpret
from mplicits.field.cells import Cells
from mplicits.field.run import run as interpret_run
from mplicits.ir.at_time import at_time
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.march import march
from support.cuda_host import PROBE, build, check_error, data, evaluate, run
from support.fitted_model import fitted_model
from support.moving_model import COMPARED_TIMES, moving_model
from support.paths import DEMO
from support.random_model import random_model
from support.scene_models import SCENE, composed

pytestmark = pytest.mark.slow

SIDE = 40


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program of a model with bands and a texture, and with small networks."""
    return build(fitted_model(), tmp_path_factory.mktemp("fitted"))


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program of a trained model with several hidden layers and a texture."""
    return build(load(DEMO), tmp_path_factory.mktemp("demo"))


def picture(path: Path) -> NDArray[np.float64]:
    return np.asarray(Image.open(path), float)


def psnr(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
    return float(10 * np.log10(255**2 / max(1e-9, ((ours - theirs) ** 2).mean())))


def drawn(program: Path, *arguments: str) -> NDArray[np.float64]:
    done = run(program, "--size", str(SIDE), "-o", "picture.ppm", *arguments)
    assert done.returncode == 0, done.stderr
    return picture(program.parent / "picture.ppm")


@pytest.mark.parametrize(
    "model",
    [
        random_model((20, 1), (24, 0), (136, 2), (264, 1), texture=(12, 1)),
        random_model((144, 1), (8, 0)),
        random_model((12, 2), (36, 1), texture=(8, 0), inputs="xyzt"),
    ],
    ids=["wide", "first level not split", "moving"],
)
def test_networks_equal_the_reference(model: Model, tmp_path: Path) -> None:
    """Layers with padding and of many widths, in one or two tiles, with and without the split into halves."""
    program, rng = lower(model), np.random.default_rng(3)
    points = rng.uniform(-1, 1, (256, 4)).astype(np.float32)
    points[:, 3] = points[0, 3] if program.moving else 1.0
    values = evaluate(build(model, tmp_path, PROBE), points)
    rows = len(model.levels) + (program.texture is not None)
    fused, together, simple = values[:rows], values[rows : 2 * rows], values[2 * rows :]
    if program.texture is not None:
        raw = np.concatenate(interpret_run(program, program.texture, points), axis=1)
        assert np.abs(fused[0, :, :3] - raw).max() < 0.01 * np.abs(raw).max()
        assert np.abs(together[0, :, :3] - fused[0, :, :3]).max() < 1e-5 * np.abs(raw).max()
        color = interpret.color(program, points[:, :3], float(points[0, 3]))
        assert np.abs(simple[-1, :, :3] - color).max() < 1e-4
        fused, together = fused[1:], together[1:]
    total = np.zeros((256, 4), np.float32)
    for level, function in enumerate(program.gradients):
        gradient, value = interpret_run(program, function, points)
        expected = np.concatenate([gradient[:, :3], value], axis=1)
        scale = np.abs(expected).max(axis=0)
        split = level == 0 and len(model.levels[0].network[0].weight) <= 128
        assert np.abs(fused[level] - expected)[:, 3].max() < (1e-5 if split else 5e-3) * scale[3]
        assert np.abs(together[level, :, 0] - fused[level, :, 3]).max() < 1e-5 * scale[3]
        assert np.abs(together[level, :, 3] - expected[:, 3]).max() < 5e-3 * scale[3]
        assert (np.abs(fused[level] - expected)[:, :3].max(axis=0) < 0.02 * scale[:3]).all()
        total += expected
        assert (np.abs(simple[level] - total).max(axis=0) < 1e-4 * np.abs(total).max(axis=0)).all()


def test_simple_draws_a_moving_model(tmp_path: Path) -> None:
    model = moving_model()
    program = build(model, tmp_path)
    eye, directions, footprint = Camera().rays(SIDE, SIDE)
    for time in COMPARED_TIMES:
        drawn = data(program, SIDE, "--variant", "simple", "--time", str(time)).reshape(-1, 4)
        there = at_time(lower(model), time)
        rays = march(there, eye, directions.reshape(-1, 3), 2, footprint, schedule="relaxed")
        assert (rays.steps == drawn[:, 1]).mean() > 0.98
        assert rays.hit.sum() > 50
        assert (rays.hit == (drawn[:, 3] > 0.5)).mean() > 0.998
        both = rays.hit & (drawn[:, 3] > 0.5)
        assert np.abs(rays.t - drawn[:, 0])[both].mean() < 1e-3
    refused = run(program, "--time", "1.5")
    assert refused.returncode == 2
    assert "--time 1.5: from 0 to 1" in refused.stderr


def test_simple_draws_a_moving_scene(tmp_path: Path) -> None:
    model = composed(tmp_path, SCENE, widths=(8, 12))
    program = build(model, tmp_path)
    eye, directions, footprint = Camera().rays(SIDE, SIDE)
    for time in (0.0, 0.8):
        drawn = data(program, SIDE, "--variant", "simple", "--time", str(time)).reshape(-1, 4)
        there = at_time(lower(model), time)
        rays = march(there, eye, directions.reshape(-1, 3), 2, footprint, schedule="relaxed")
        both = rays.hit & (drawn[:, 3] > 0.5)
        assert both.sum() > 100
        assert (rays.hit == (drawn[:, 3] > 0.5)).mean() > 0.995
        assert np.abs(rays.t - drawn[:, 0])[both].mean() < 1e-3
        assert set(drawn[both, 2]) == {2.0}
    done = run(program, "--benchmark", "--frames", "1", "--size", "8", "-o", "scene.ppm")
    assert [row["variant"] for row in json.loads(done.stdout)["sizes"][0]["variants"]] == ["simple"]
    refused = run(program, "--variant", "fused")
    assert refused.returncode == 2
    assert "a scene has only the variant simple" in refused.stderr


def test_time_is_refused_for_a_model_without_motion(fitted: Path) -> None:
    refused = run(fitted, "--time", "0")
    assert (refused.returncode, "does not move" in refused.stderr) == (2, True)


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("--level", "1", "--normal-level", "2"),
        ("--shade", "texture", "--camera", "-120,-10,2.5"),
        ("--shade", "softbox", "--camera", "-50,25"),
        ("--shade", "steps"),
        ("--shade", "depth", "--fov", "50"),
        ("--shade", "normal", "--delta-scale", "0.8"),
        ("--light", "1,0,0.2", "--background", "#ff8000,203040", "--step-scale", "0.9"),
    ],
    ids=["plain", "normal mapping", "camera", "softbox", "steps", "depth", "normal", "light"],
)
def test_simple_draws_the_picture_of_glsl(fitted: Path, fitted_shader: Renderer, arguments: tuple[str, ...]) -> None:
    options_of = dict(zip(arguments[::2], arguments[1::2], strict=True))
    azimuth, elevation, *distance = map(float, options_of.get("--camera", "30,20").split(","))
    camera = Camera(azimuth, elevation, distance[0] if distance else None, fov=float(options_of.get("--fov", "35")))
    top, bottom = (tuple(int(c[i : i + 2], 16) / 255 for i in (0, 2, 4)) for c in ("ff8000", "203040"))
    options = RenderOptions(
        schedule="plain",
        level=int(options_of["--level"]) if "--level" in options_of else None,
        normal_level=int(options_of["--normal-level"]) if "--normal-level" in options_of else None,
        shade=options_of.get("--shade", "phong"),
        delta_scale=float(options_of.get("--delta-scale", "1")),
        step_scale=float(options_of["--step-scale"]) if "--step-scale" in options_of else None,
        light=(1, 0, 0.2) if "--light" in options_of else None,
        background=(top, bottom) if "--background" in options_of else None,  # type: ignore[arg-type]
    )
    theirs = 255 * fitted_shader.render((SIDE, SIDE), camera, options)[..., :3].clip(0, 1)
    assert psnr(drawn(fitted, "--variant", "simple", "--schedule", "plain", *arguments), theirs) > 50


@pytest.fixture(scope="module")
def fitted_shader(osmesa: Context) -> Renderer:
    """The kernels take no Newton's steps first."""
    return Renderer(osmesa, replace(bake(fitted_model(), passes=True), newton_first=False))


@pytest.mark.parametrize("rounds", [32, 1])
@pytest.mark.parametrize("schedule", ["plain", "relaxed"])
@pytest.mark.parametrize("variant", ["simple", "fused"])
def test_data_equals_glsl(fitted: Path, fitted_shader: Renderer, variant: str, schedule: str, rounds: int) -> None:
    """The level is 0 only where the ray missed the ball."""
    ours = data(fitted, SIDE, "--variant", variant, "--rounds", str(rounds), "--schedule", schedule)
    theirs = fitted_shader.render(
        (SIDE, SIDE), Camera(30, 20), RenderOptions(shade="data", rounds=rounds, schedule=schedule)
    )
    assert set(np.unique(theirs[..., 2])) == {0, 1, 2}
    assert (ours[..., 1:] == theirs[..., 1:]).mean(axis=(0, 1)).min() > 0.99, "steps, level, hit"
    assert ((ours[..., 2] == 0) == (ours[..., 1] == 0)).all()
    seen = (ours[..., 3] > 0.5) & (theirs[..., 3] > 0.5)
    assert np.abs(ours - theirs)[seen][:, 0].mean() < 1e-4


@pytest.mark.parametrize("variant", ["simple", "fused"])
@pytest.mark.parametrize("schedule", ["plain", "relaxed"])
def test_rays_take_the_steps_of_the_reference(demo: Path, schedule: str, variant: str) -> None:
    """With the grid of cells. Fused rounds to halves, which sometimes moves the field across a threshold."""
    program = lower(load(DEMO))
    eye, directions, footprint = Camera(30, 20).rays(SIDE, SIDE)
    rays = march(program, eye, directions.reshape(-1, 3), 2, footprint, schedule=schedule, cells=Cells(program))
    ours = data(demo, SIDE, "--variant", variant, "--schedule", schedule).reshape(-1, 4)
    assert (rays.hit == (ours[:, 3] > 0.5)).mean() > 0.998
    assert (rays.steps == ours[:, 1]).mean() > 0.98
    assert np.abs(rays.t - ours[:, 0])[rays.hit].mean() < 1e-4


@pytest.mark.parametrize(
    "arguments", [("--level", "1"), ("--delta-scale", "0.9")], ids=["before the last level", "narrow"]
)
def test_rays_skip_no_cells_at_other_levels_and_bands(demo: Path, arguments: tuple[str, str]) -> None:
    """Rays that skip cells evaluate the field only near the shape, so they take fewer steps."""
    first = [data(demo, SIDE, "--variant", "simple", *options)[..., 1].sum() for options in (arguments, ())]
    assert first[0] > 1.5 * first[1]


@pytest.mark.parametrize(("schedule", "first"), [("plain", 0), ("relaxed", 1)])
def test_no_ray_is_lost_or_counted_twice(fitted: Path, schedule: str, first: int) -> None:
    """The statistics equal the sums of steps and of hit pixels. first: index of the first phase."""
    for rounds in ("32", "1"):
        settings = ("--rounds", rounds, "--iterations", "3,2", "--schedule", schedule)
        raw, simple = (data(fitted, SIDE, "--variant", variant, *settings) for variant in ("fused", "simple"))
        done = run(
            fitted, "--benchmark", "--variant", "fused", "--frames", "1", "--size", str(SIDE), *settings, "-o", "x.ppm"
        )
        (statistics,) = json.loads(done.stdout)["sizes"][0]["variants"]
        assert statistics["evaluations"][0] == raw[..., 1].sum()
        assert statistics["hits"] == (raw[..., 3] > 0.5).sum() > 0
        assert statistics["rays_per_round"][0][first] == (raw[..., 1] > 0).sum()
        assert statistics["rays_per_round"][0][1] > 0
        assert (raw[..., 3] == simple[..., 3]).mean() > 0.995
        assert 0.1 < statistics["lanes_in_use"][0] <= 1
        assert picture(fitted.parent / f"x-fused-{SIDE}.ppm").shape == (SIDE, SIDE, 3)


def test_benchmark_is_json_of_every_variant(fitted: Path) -> None:
    done = run(fitted, "--benchmark", "--frames", "2", "--size", "9x5", "-o", "b.ppm")
    (size,) = json.loads(done.stdout)["sizes"]
    assert [row["variant"] for row in size["variants"]] == ["simple", "fused"]
    assert {"fps", "milliseconds", "stages", "memory_mib", "useful_tflops"} <= set(size["variants"][1])


def test_check_accepts_the_same_picture_only(fitted: Path) -> None:
    run(fitted, "--variant", "simple", "--size", "16", "-o", "want.ppm")
    good = run(fitted, "--variant", "fused", "--size", "16", "--check", "want.ppm")
    assert (good.returncode, good.stdout[:6]) == (0, "agrees")
    bad = run(fitted, "--variant", "fused", "--size", "16", "--check", "want.ppm", "--camera", "90,0")
    assert (bad.returncode, bad.stdout[:9]) == (1, "DISAGREES")


@pytest.mark.parametrize(
    ("arguments", "environment", "message"),
    [
        ((), {"DEVICES": "0"}, "no CUDA device"),
        (("--variant", "fused"), {"MAJOR": "7"}, "compute capability 8.0"),
        (("--size", "4096"), {"MEMORY": "100000000"}, "out of memory"),
        (("--level", "3"), {}, "--level 3: from 1 to 2"),
        (("--size", "12x"), {}, "--size"),
        (("--schedule", "dense"), {}, "--schedule dense: plain or relaxed"),
        (("--check", "nowhere.ppm", "--size", "8"), {}, "cannot read nowhere.ppm"),
        (("-o", "no/where.ppm", "--size", "8"), {}, "cannot write no/where.ppm"),
        (("--wrong",), {}, "--wrong: no such option"),
    ],
    ids=["device", "old", "memory", "level", "size", "schedule", "reference", "output", "option"],
)
def test_errors_are_one_line(
    fitted: Path, arguments: tuple[str, ...], environment: dict[str, str], message: str
) -> None:
    check_error(run(fitted, *arguments, **environment), message)


def test_an_old_gpu_draws_by_simple(fitted: Path) -> None:
    assert run(fitted, "--size", "8", "-o", "old.ppm", MAJOR="7").returncode == 0
