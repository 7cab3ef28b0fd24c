"""The desk: what is drawn when, what happens to files that are opened, watched, dropped; jobs; training."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from mplicits.codegen.targets.glsl330 import standalone
from mplicits.model.model import save
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state import jobs
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from PIL import Image

from support.desk_fixture import AREA, is_open, settle, shown
from support.random_model import random_model


def test_at_rest_it_is_what_render_draws(make: Callable[..., Desk]) -> None:
    desk = make(samples=4)
    settle(desk)
    view = desk.view
    wanted = desk.renderer.render(AREA, view.camera, view.options)[..., :3]
    np.testing.assert_allclose(shown(desk), wanted, atol=2e-5)
    view.set(plain=True, shading="normal")
    settle(desk)
    other = desk.renderer.render(AREA, view.camera, view.options)[..., :3]
    assert np.abs(other - wanted).max() > 0.1
    np.testing.assert_allclose(shown(desk), other, atol=2e-5)


def test_nothing_is_drawn_while_nothing_changes(make: Callable[..., Desk]) -> None:
    desk = make(samples=2)
    settle(desk)
    assert desk.stale
    desk.stale = False
    assert [desk.tick(AREA) for _ in range(5)] == [None] * 5
    assert not desk.stale


def test_fewer_pixels_while_it_moves_and_all_of_them_at_rest(make: Callable[..., Desk]) -> None:
    desk = make()
    desk.view.coarse = 2
    settle(desk)
    desk.view.coarse = 2
    desk.view.turn(0.1, 0.0)
    due = desk.tick(AREA)
    assert desk.timing.startswith("12x8 ")
    assert due is not None
    assert due > 0.0, "the rest of the pixels wait for the end of the move"
    settle(desk)
    assert desk.timing.startswith("24x16 ")


def test_split_view_is_one_level_beside_another(make: Callable[..., Desk]) -> None:
    desk = make(level=1)
    desk.view.split = 2
    settle(desk)
    each = [desk.renderer.render(AREA, desk.view.camera, RenderOptions(level=level))[..., :3] for level in (1, 2)]
    wanted = np.concatenate([each[0][:, :12], each[1][:, 12:]], axis=1)
    assert np.abs(wanted - each[0]).max() > 0.01
    np.testing.assert_allclose(shown(desk), wanted, atol=2e-5)


def test_resolution_draws_fewer_pixels(make: Callable[..., Desk]) -> None:
    desk = make()
    desk.view.resolution = 0.5
    settle(desk)
    assert desk.timing.startswith("12x8 ")


def test_sizes_from_one_pixel_up(make: Callable[..., Desk]) -> None:
    desk = make(samples=2)
    for area in ((1, 1), (1, 900), (700, 2)):
        desk.view.resize(area)
        for _ in range(2000):
            if desk.tick(area) is None:
                break
        assert desk.tick(area) is None


def test_a_dropped_model_is_shown(make: Callable[..., Desk], tmp_path: Path) -> None:
    desk = make(level=2)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    drop(desk, [tmp_path / "one.safetensors"])
    settle(desk, lambda: desk.source.name == "one")
    assert (desk.view.levels, desk.view.options.level) == (1, None)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("bad.safetensors", b"\0" * 40, "bad.safetensors"),
        ("bad.glsl", b"void main() {}", "LEVELS"),
        ("bad.glsl", b"\xff\xfe", "not text"),
        ("missing.safetensors", None, "missing.safetensors"),
        ("notes.txt", b"", "neither a model"),
    ],
)
def test_a_dropped_file_that_is_none_is_told(
    make: Callable[..., Desk], tmp_path: Path, name: str, content: bytes | None, reason: str
) -> None:
    desk = make()
    if content is not None:
        (tmp_path / name).write_bytes(content)
    drop(desk, [tmp_path / name])
    settle(desk, lambda: reason in desk.message)
    assert desk.source.name == "two"


def test_a_baked_file_draws_the_same(make: Callable[..., Desk], tmp_path: Path) -> None:
    desk = make()
    settle(desk)
    before = shown(desk)
    for storage in ("literal", "texture"):
        path = tmp_path / f"{storage}.glsl"
        path.write_text(standalone(random_model((4, 0), (8, 0), texture=(4, 0), name="two"), storage))
        desk.open(path)
        settle(desk, partial(is_open, desk, path))
        assert desk.source.name == "two"
        assert desk.source.textured
        assert np.quantile(np.abs(shown(desk) - before), 0.95) < 1e-3, "all but the silhouette"


def test_watch_shows_the_new_file_and_keeps_the_picture_of_one_that_does_not_compile(
    make: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mplicits.viewer.state.desk.LOOK", 0.01)
    path = tmp_path / "shader.glsl"
    good = standalone(random_model((4, 0), (8, 0)))
    path.write_text(good)
    desk = make(watch=True)
    desk.open(path)
    settle(desk, lambda: desk.source.path == path)
    before = shown(desk)
    line = next(k for k, text in enumerate(good.splitlines(), start=1) if "vec3 toward" in text)
    path.write_text(good.replace("vec3 toward = normalize(", "vec3 toward = normalise("))
    settle(desk, lambda: bool(desk.log))
    assert f"line {line}" in desk.log[0]
    assert "normalise" in desk.log[0]
    np.testing.assert_array_equal(shown(desk), before)
    path.write_text(good.replace("color = vec4(colour, 1.0)", "color = vec4(1.0, 0.0, 0.0, 1.0)"))
    settle(desk, lambda: not desk.log and not desk.view.changed)
    assert np.isclose(shown(desk), (1, 0, 0), atol=1e-3).all(axis=-1).any()


def test_an_error_in_the_glsl_folder_is_placed_there(
    make: Callable[..., Desk], monkeypatch: pytest.MonkeyPatch
) -> None:
    from mplicits import glsl

    desk = make()
    read = glsl.read
    wrong = read("march.glsl").replace("++ray.steps;", "++ray.steeps;")
    monkeypatch.setattr(glsl, "read", lambda name: wrong if name == "march.glsl" else read(name))
    desk.open(desk.source.path)
    settle(desk, lambda: bool(desk.log))
    line = next(k for k, text in enumerate(wrong.splitlines(), start=1) if "steeps" in text)
    assert f"march.glsl:{line}" in desk.log[0]


def test_what_draws_is_not_taken_away_from_a_job(make: Callable[..., Desk], tmp_path: Path) -> None:
    desk = make()
    settle(desk)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    scene = Scene((1200, 800), replace(desk.view.camera, aspect=1.5), desk.view.options)
    desk.begin(jobs.picture(desk.drawn, tmp_path / "p.png", scene, "two"), draws=True)
    desk.tick(AREA)
    desk.open(tmp_path / "one.safetensors")
    settle(desk, lambda: desk.source.name == "one")
    assert desk.job is None
    assert not (tmp_path / "p.png").exists()


def test_a_split_view_is_saved_as_it_is_shown(make: Callable[..., Desk], tmp_path: Path) -> None:
    desk = make(level=1)
    desk.view.split = 2
    settle(desk)
    scene = desk.view.scene(AREA)
    desk.begin(jobs.picture(desk.drawn, tmp_path / "p.png", scene, "two"), draws=True)
    settle(desk, lambda: desk.job is None)
    assert np.abs(np.asarray(Image.open(tmp_path / "p.png")) / 255 - shown(desk)).max() < 0.6 / 255


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("float delta[LEVELS] = float[](", "float delta[LEVELS] = float[](.5e, "),
        ("int[](20,", "int[](70000,"),
    ],
)
def test_numbers_that_are_none_or_too_large_are_told(
    make: Callable[..., Desk], tmp_path: Path, before: str, after: str
) -> None:
    desk, path = make(), tmp_path / "shader.glsl"
    text = standalone(random_model((4, 0), (8, 0)))
    assert before in text
    path.write_text(text.replace(before, after))
    desk.open(path)
    settle(desk, lambda: "opening" not in desk.message)
    assert desk.message
    assert desk.source.path != path
