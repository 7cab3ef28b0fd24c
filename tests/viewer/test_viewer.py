"""The viewer without a window: when it draws, and files that the user opens, watches or drops."""

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
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from support.random_model import random_model
from support.viewer_fixture import AREA, TWO, OpenViewer, is_open, picture_of, settle


def test_the_picture_at_rest_matches_render(open_viewer: OpenViewer) -> None:
    viewer = open_viewer(samples=4)
    settle(viewer)
    view = viewer.view
    rendered = viewer.renderer.render(AREA, view.camera, view.options)[..., :3]
    np.testing.assert_allclose(picture_of(viewer), rendered, atol=2e-5)
    view.set(plain=True, shade="normal")
    settle(viewer)
    other = viewer.renderer.render(AREA, view.camera, view.options)[..., :3]
    assert np.abs(other - rendered).max() > 0.1
    np.testing.assert_allclose(picture_of(viewer), other, atol=2e-5)


def test_an_unchanged_picture_is_not_drawn_again(open_viewer: OpenViewer) -> None:
    viewer = open_viewer(samples=2)
    settle(viewer)
    assert viewer.stale
    viewer.stale = False
    assert [viewer.tick(AREA) for _ in range(5)] == [None] * 5
    assert not viewer.stale
    for seconds, line in ((0.0251, "24x16 in 25.1 ms"), (24.0188, "24x16 in 24.0 s")):
        viewer.drawing._set_timing(seconds, AREA)
        assert viewer.drawing.timing == line


def test_a_moving_camera_draws_fewer_pixels_and_one_at_rest_all(open_viewer: OpenViewer) -> None:
    viewer = open_viewer()
    settle(viewer)
    viewer.view.coarse = 2
    viewer.view.turn(0.1, 0.0)
    due = viewer.tick(AREA)
    assert viewer.drawing.timing.startswith("12x8 ")
    assert due is not None
    assert due > 0.0, "the other pixels wait for the end of the move"
    settle(viewer)
    assert viewer.drawing.timing.startswith("24x16 ")
    viewer.view.change(resolution=0.5)
    settle(viewer)
    assert viewer.drawing.timing.startswith("12x8 ")


def test_a_split_view_shows_and_saves_two_levels(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer(level=1)
    viewer.view.split = 2
    settle(viewer)
    left, right = (
        viewer.renderer.render(AREA, viewer.view.camera, RenderOptions(level=level))[..., :3] for level in (1, 2)
    )
    expected = np.concatenate([left[:, :12], right[:, 12:]], axis=1)
    assert np.abs(expected - left).max() > 0.01
    np.testing.assert_allclose(picture_of(viewer), expected, atol=2e-5)
    scene = viewer.view.scene(AREA)
    viewer.work.begin(jobs.write_picture(viewer.current_renderer(), tmp_path / "p.png", scene, "two"), draws=True)
    settle(viewer, lambda: viewer.work.job is None)
    assert np.abs(np.asarray(Image.open(tmp_path / "p.png")) / 255 - expected).max() < 1.1 / 255


def test_pictures_of_extreme_sizes_are_drawn(open_viewer: OpenViewer) -> None:
    viewer = open_viewer(samples=2)
    for area in ((1, 1), (1, 900), (700, 2)):
        viewer.view.resize(area)
        for _ in range(2000):
            if viewer.tick(area) is None:
                break
        assert viewer.tick(area) is None


def test_a_dropped_model_is_shown(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer(level=2)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    drop(viewer, [tmp_path / "one.safetensors"])
    settle(viewer, lambda: viewer.source.name == "one")
    assert (viewer.view.levels, viewer.view.options.level) == (1, None)


def test_bad_dropped_files_are_reported(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer()
    for name, content, reason in (
        ("bad.safetensors", b"\0" * 40, "bad.safetensors"),
        ("bad.glsl", b"void main() {}", "header line"),
        ("bad.glsl", b"\xff\xfe", "not text"),
        ("missing.safetensors", None, "missing.safetensors"),
        ("notes.docx", b"", "neither a model"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        drop(viewer, [tmp_path / name])
        settle(viewer, lambda reason=reason: reason in viewer.message)  # type: ignore[misc]
        assert viewer.source.name == "two"


def test_a_baked_shader_file_draws_the_same_picture_as_its_model(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer()
    settle(viewer)
    before = picture_of(viewer)
    for storage in ("literal", "texture"):
        path = tmp_path / f"{storage}.glsl"
        path.write_text(standalone(TWO, storage))
        viewer.open(path)
        settle(viewer, partial(is_open, viewer, path))
        assert viewer.source.name == "two"
        assert viewer.source.textured
        assert np.quantile(np.abs(picture_of(viewer) - before), 0.95) < 5e-3, "a file has no grid of cells"


def test_a_watched_file_is_reloaded_unless_it_does_not_compile(
    open_viewer: OpenViewer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mplicits.viewer.state.files.WATCH_INTERVAL", 0.01)
    path = tmp_path / "shader.glsl"
    good = standalone(TWO)
    path.write_text(good)
    viewer = open_viewer(watch=True)
    viewer.open(path)
    settle(viewer, lambda: viewer.source.path == path)
    before = picture_of(viewer)
    line = next(k for k, text in enumerate(good.splitlines(), start=1) if "vec3 toward" in text)
    path.write_text(good.replace("vec3 toward = normalize(", "vec3 toward = normalise("))
    settle(viewer, lambda: bool(viewer.log))
    assert f"line {line}" in viewer.log[0]
    assert "normalise" in viewer.log[0]
    np.testing.assert_array_equal(picture_of(viewer), before)
    path.write_text(
        good.replace(
            "color.rgb = surface_color(normal, direction, t, ray.steps, ray.hit, color.rgb)",
            "color = vec4(1.0, 0.0, 0.0, 1.0)",
        )
    )
    settle(viewer, lambda: not viewer.log and not viewer.view.changed)
    assert np.isclose(picture_of(viewer), (1, 0, 0), atol=1e-3).all(axis=-1).any()


def test_an_error_in_the_glsl_folder_names_its_file_and_line(
    open_viewer: OpenViewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mplicits import glsl

    viewer = open_viewer()
    read = glsl.read
    wrong = read("march.glsl").replace("++ray.steps;", "++ray.steeps;")
    monkeypatch.setattr(glsl, "read", lambda name: wrong if name == "march.glsl" else read(name))
    viewer.open(viewer.source.path)
    settle(viewer, lambda: bool(viewer.log))
    line = next(k for k, text in enumerate(wrong.splitlines(), start=1) if "steeps" in text)
    assert f"march.glsl:{line}" in viewer.log[0]


def test_another_model_cancels_a_job_that_draws(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer()
    settle(viewer)
    save(random_model((4, 0), name="one"), tmp_path / "one.safetensors")
    scene = Scene((1200, 800), replace(viewer.view.camera, aspect=1.5), viewer.view.options)
    viewer.work.begin(jobs.write_picture(viewer.current_renderer(), tmp_path / "p.png", scene, "two"), draws=True)
    viewer.tick(AREA)
    viewer.open(tmp_path / "one.safetensors")
    settle(viewer, lambda: viewer.source.name == "one")
    assert viewer.work.job is None
    assert not (tmp_path / "p.png").exists()


def test_bad_numbers_in_a_shader_file_are_reported(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer, path = open_viewer(), tmp_path / "shader.glsl"
    text = standalone(random_model((4, 0), (8, 0)))
    for before, after in (
        ("float delta[LEVELS] = float[](", "float delta[LEVELS] = float[](.5e, "),
        ('"deltas": [1.0,', '"deltas": [null,'),
        ('"value_loops": [0, 0', '"value_loops": [0, 70000'),
    ):
        assert before in text
        path.write_text(text.replace(before, after))
        viewer.open(path)
        settle(viewer, lambda: "opening" not in viewer.message)
        assert viewer.message
        assert viewer.source.path != path
