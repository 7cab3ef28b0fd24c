"""A briefly trained model of the paper's sizes, (64, 2) > (128, 2) > (256, 2), on software GL."""

from pathlib import Path

import numpy as np
import pytest

from mplicits import cli
from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shader import LOOP_LIMIT
from mplicits.ir.lower import lower
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march
from support.ball_training import use_quick_config

SIDE = 48


@pytest.mark.slow
def test_the_picture_equals_dense_marching_within_the_loop_limit(
    osmesa: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_quick_config(monkeypatch)
    path = tmp_path / "paper.safetensors"
    train = ["train", "demo", "-o", str(path), "--preset", "paper", "--steps", "800,200,100", "--texture", "none"]
    assert cli.main([*train, "--quiet"]) == 0
    model = load(path)
    shader = bake(model)
    assert shader.weights is not None
    assert "const mat4 w1_2_15_15" in shader.text, "64 wide: literals"
    renderer = Renderer(osmesa, shader)
    options = RenderOptions(shade="data")
    steps, rounds = renderer.schedule(options)
    assert rounds < renderer.wanted_rounds(options)
    assert shader.worst_loops(3, 3, steps, rounds, "relaxed") <= LOOP_LIMIT
    camera = Camera(35, 25)
    eye, directions, footprint = camera.rays(SIDE, SIDE)
    closest, _ = dense_march(lower(model), eye, directions.reshape(-1, 3), 3, footprint)
    expected = closest.reshape(SIDE, SIDE) == 0
    picture = renderer.render((SIDE, SIDE), camera, options)
    hit = picture[..., 3] > 0.5
    assert expected.mean() > 0.1
    assert (expected & ~hit).sum() <= 0.005 * expected.sum()
    assert (hit & (closest.reshape(SIDE, SIDE) > 0.5)).sum() <= 0.005 * expected.sum()
    assert np.median(picture[..., 1][hit]) < 40
