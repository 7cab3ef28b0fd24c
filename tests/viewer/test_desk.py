"""The desk: what is drawn when, and what becomes of files that are opened, watched and dropped."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits.codegen.targets.glsl330 import standalone
from mplicits.model.model_file import save
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state import jobs
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from support.desk_fixture import AREA, TWO, is_open, picture_of, settle
from support.random_model import random_model


def test_the_picture_at_rest_is_what_render_draws(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk(samples=4)
    settle(desk)
    view = desk.shown.view
    rendered = desk.shown.renderer.render(AREA, view.camera, view.options)[..., :3]
    np.testing.assert_allclose(picture_of(desk), rendered, atol=2e-5)
    view.set(plain=True, shade="normal")
    settle(desk)
    other = desk.shown.renderer.render(AREA, view.camera, view.options)[..., :3]
    assert np.abs(other - rendered).max() > 0.1
    np.testing.assert_allclose(picture_of(desk), other, atol=2e-5)


def test_the_time_of_a_slow_picture_is_in_seconds(open_desk: Callable[..., Desk]) -> None:
    drawing = open_desk().drawing
    for seconds, line in ((0.0251, "24x16 in 25.1 ms"), (24.0188, "24x16 in 24.0 s")):
        drawing._tell(seconds, AREA)
        assert drawing.timing == line


def test_nothing_is_drawn_while_nothing_changes(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk(samples=2)
    settle(desk)
    assert desk.stale
    desk.stale = False
    assert [desk.tick(AREA) for _ in range(5)] == [None] * 5
    assert not desk.stale


def test_fewer_pixels_are_drawn_while_the_camera_moves_and_all_of_them_at_rest(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk()
    desk.shown.view.coarse = 2
    settle(desk)
    desk.shown.view.coarse = 2
    desk.shown.view.turn(0.1, 0.0)
    due = desk.tick(AREA)
    assert desk.drawing.timing.startswith("12x8 ")
    assert due is not None
    assert due > 0.0, "the other pixels wait for the end of the move"
    settle(desk)
    assert desk.drawing.timing.startswith("24x16 ")


def test_a_split_view_shows_one_level_beside_another(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk(level=1)
    desk.shown.view.split = 2
    settle(desk)
    pictures = [
        desk.shown.renderer.render(AREA, desk.shown.view.camera, RenderOptions(level=level))[..., :3]
        for level in (1, 2)
    ]
    expected = np.concatenate([pictures[0][:, :12], pictures[1][:, 12:]], axis=1)
    assert np.abs(expected - pictures[0]).max() > 0.01
    np.testing.assert_allclose(picture_of(desk), expected, atol=2e-5)


def test_a_lower_resolution_draws_fewer_pixels(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk()
    desk.shown.view.resolution = 0.5
    settle(desk)
    assert desk.drawing.timing.startswith("12x8 ")


def test_pictures_of_any_size_are_drawn_to_the_end(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk(samples=2)
    for area in ((1, 1), (1, 900), (700, 2)):
        desk.shown.view.resize(area)
        for _ in range(2000):
            if desk.tick(area) is None:
                break
        assert desk.tick(area) is None


def test_a_dropped_model_is_shown(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    desk = open_desk(level=2)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    drop(desk, [tmp_path / "one.safetensors"])
    settle(desk, lambda: desk.shown.source.name == "one")
    assert (desk.shown.view.levels, desk.shown.view.options.level) == (1, None)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("bad.safetensors", b"\0" * 40, "bad.safetensors"),
        ("bad.glsl", b"void main() {}", "header line"),
        ("bad.glsl", b"\xff\xfe", "not text"),
        ("missing.safetensors", None, "missing.safetensors"),
        ("notes.txt", b"", "neither a model"),
    ],
)
def test_the_user_is_told_why_a_dropped_file_is_not_shown(
    open_desk: Callable[..., Desk], tmp_path: Path, name: str, content: bytes | None, reason: str
) -> None:
    desk = open_desk()
    if content is not None:
        (tmp_path / name).write_bytes(content)
    drop(desk, [tmp_path / name])
    settle(desk, lambda: reason in desk.message)
    assert desk.shown.source.name == "two"


def test_a_baked_shader_file_draws_the_same_picture_as_its_model(
    open_desk: Callable[..., Desk], tmp_path: Path
) -> None:
    desk = open_desk()
    settle(desk)
    before = picture_of(desk)
    for storage in ("literal", "texture"):
        path = tmp_path / f"{storage}.glsl"
        path.write_text(standalone(TWO, storage))
        desk.open(path)
        settle(desk, partial(is_open, desk, path))
        assert desk.shown.source.name == "two"
        assert desk.shown.source.textured
        assert np.quantile(np.abs(picture_of(desk) - before), 0.95) < 5e-3, "a file has no grid of cells"


def test_a_watched_file_is_shown_when_it_changes_and_the_picture_stays_where_it_does_not_compile(
    open_desk: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mplicits.viewer.state.files.WATCH_INTERVAL", 0.01)
    path = tmp_path / "shader.glsl"
    good = standalone(TWO)
    path.write_text(good)
    desk = open_desk(watch=True)
    desk.open(path)
    settle(desk, lambda: desk.shown.source.path == path)
    before = picture_of(desk)
    line = next(k for k, text in enumerate(good.splitlines(), start=1) if "vec3 toward" in text)
    path.write_text(good.replace("vec3 toward = normalize(", "vec3 toward = normalise("))
    settle(desk, lambda: bool(desk.log))
    assert f"line {line}" in desk.log[0]
    assert "normalise" in desk.log[0]
    np.testing.assert_array_equal(picture_of(desk), before)
    path.write_text(
        good.replace(
            "colour.rgb = surface(normal, direction, t, ray.steps, ray.hit, colour.rgb)",
            "colour = vec4(1.0, 0.0, 0.0, 1.0)",
        )
    )
    settle(desk, lambda: not desk.log and not desk.shown.view.changed)
    assert np.isclose(picture_of(desk), (1, 0, 0), atol=1e-3).all(axis=-1).any()


def test_an_error_in_the_glsl_folder_is_told_with_its_file_and_line(
    open_desk: Callable[..., Desk], monkeypatch: pytest.MonkeyPatch
) -> None:
    from mplicits import glsl

    desk = open_desk()
    read = glsl.read
    wrong = read("march.glsl").replace("++ray.steps;", "++ray.steeps;")
    monkeypatch.setattr(glsl, "read", lambda name: wrong if name == "march.glsl" else read(name))
    desk.open(desk.shown.source.path)
    settle(desk, lambda: bool(desk.log))
    line = next(k for k, text in enumerate(wrong.splitlines(), start=1) if "steeps" in text)
    assert f"march.glsl:{line}" in desk.log[0]


def test_a_job_that_draws_is_cancelled_when_another_model_replaces_its_renderer(
    open_desk: Callable[..., Desk], tmp_path: Path
) -> None:
    desk = open_desk()
    settle(desk)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    scene = Scene((1200, 800), replace(desk.shown.view.camera, aspect=1.5), desk.shown.view.options)
    desk.work.begin(jobs.write_picture(desk.drawn_by(), tmp_path / "p.png", scene, "two"), draws=True)
    desk.tick(AREA)
    desk.open(tmp_path / "one.safetensors")
    settle(desk, lambda: desk.shown.source.name == "one")
    assert desk.work.job is None
    assert not (tmp_path / "p.png").exists()


def test_a_split_view_is_saved_as_it_is_shown(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    desk = open_desk(level=1)
    desk.shown.view.split = 2
    settle(desk)
    scene = desk.shown.view.scene(AREA)
    desk.work.begin(jobs.write_picture(desk.drawn_by(), tmp_path / "p.png", scene, "two"), draws=True)
    settle(desk, lambda: desk.work.job is None)
    assert np.abs(np.asarray(Image.open(tmp_path / "p.png")) / 255 - picture_of(desk)).max() < 1.1 / 255


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("float delta[LEVELS] = float[](", "float delta[LEVELS] = float[](.5e, "),
        ('"deltas": [1.0,', '"deltas": [null,'),
        ('"value_loops": [0, 0', '"value_loops": [0, 70000'),
    ],
)
def test_the_user_is_told_of_a_shader_file_with_malformed_or_too_large_numbers(
    open_desk: Callable[..., Desk], tmp_path: Path, before: str, after: str
) -> None:
    desk, path = open_desk(), tmp_path / "shader.glsl"
    text = standalone(random_model((4, 0), (8, 0)))
    assert before in text
    path.write_text(text.replace(before, after))
    desk.open(path)
    settle(desk, lambda: "opening" not in desk.message)
    assert desk.message
    assert desk.shown.source.path != path
