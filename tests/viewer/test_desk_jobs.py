"""The work beside the picture: exports, videos, timings of the levels, training."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.bake.registry import TARGETS
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.screenshot import to_png
from mplicits.viewer.state import jobs
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.exports import free_path
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from support.desk_fixture import AREA, TETRAHEDRON, picture_of, settle
from support.fitted_model import fitted_model


def test_exports_are_what_the_command_line_writes(
    open_desk: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    desk = open_desk(samples=2)
    settle(desk)
    model = desk.shown.source.model
    assert model is not None
    for name in ("model", *TARGETS):
        path = free_path("export", f".{name}")
        desk.work.begin(jobs.write_target(name, model, path))
        settle(desk, lambda: desk.work.job is None)
        assert desk.message == f"saved {path}"
        if name == "model":
            assert load(path).name == "two"
        else:
            assert path.read_text(encoding="utf-8") == TARGETS[name](model)
    size, camera, path = (600, 20), replace(desk.shown.view.camera, aspect=30.0), free_path("export", ".png")
    desk.work.begin(jobs.write_picture(desk.shown.renderer, path, Scene(size, camera, desk.shown.view.options), "two"))
    settle(desk, lambda: desk.work.job is None)
    rendered = desk.shown.renderer.render(size, camera, desk.shown.view.options)[..., :3]
    assert np.abs(np.asarray(Image.open(path)) / 255 - rendered).max() < 1.1 / 255
    assert free_path("export", ".png") == Path("export-2.png")
    assert free_path("../a b", ".png") == Path("a-b.png")


def test_the_window_goes_on_while_a_png_is_encoded(
    open_desk: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_encode = Event()

    def slow(image: NDArray[np.float32], title: str) -> bytes:
        assert may_encode.wait(60.0)
        return to_png(image, title)

    monkeypatch.setattr("mplicits.viewer.state.jobs.to_png", slow)
    desk, path = open_desk(), tmp_path / "p.png"
    settle(desk)
    for cancelled in (True, False):
        may_encode.clear()
        scene = Scene(AREA, desk.shown.view.camera, desk.shown.view.options)
        desk.work.begin(jobs.write_picture(desk.shown.renderer, path, scene, "two"), draws=True)
        while not desk.work.job_progress[1].startswith("writing"):
            desk.tick(AREA)
        before = picture_of(desk)
        desk.shown.view.turn(0.2, 0.0)
        for _ in range(50):
            desk.tick(AREA)
        assert np.abs(picture_of(desk) - before).max() > 0.1
        if cancelled:
            desk.work.cancel()
        else:
            desk.work.cancel_drawing()
        may_encode.set()
        settle(desk)
        assert path.exists() is not cancelled


def test_a_turntable_video_shows_one_turn(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="PyAV is not installed (extra view)")
    desk, path = open_desk(), tmp_path / "turn.mp4"
    desk.work.begin(
        jobs.Video((32, 24), seconds=0.4, rate=10).write(
            desk.shown.renderer, path, Scene(AREA, Camera(), desk.shown.view.options)
        )
    )
    settle(desk, lambda: desk.work.job is None)
    with av.open(str(path)) as video:
        pictures = [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]
    assert len(pictures) == 4
    grey = [
        desk.shown.renderer.render((32, 24), Camera(aspect=4 / 3).orbited(90.0 * k, 0.0), desk.shown.view.options)[
            ..., 1
        ]
        for k in range(4)
    ]
    for k, picture in enumerate(pictures):
        off = [np.abs(picture.mean(axis=-1) / 255 - other).mean() for other in grey]
        assert off.index(min(off)) == k
    assert list(tmp_path.glob(".*")) == []


def test_the_timings_of_the_levels_agree_with_the_raw_data(open_desk: Callable[..., Desk]) -> None:
    desk = open_desk()
    timings: list[jobs.LevelTiming] = []
    view = desk.shown.view
    desk.work.begin(jobs.time_levels(desk.shown.renderer, AREA, view.camera, view.options, timings.extend))
    settle(desk, lambda: desk.work.job is None)
    data = desk.shown.renderer.render(AREA, view.camera, RenderOptions(shade="data"))
    assert len(timings) == 2
    assert all(timing.milliseconds > 0 for timing in timings)
    assert timings[1].steps == pytest.approx(data[..., 1].mean())
    never = (data[..., 1] == 0).mean()
    assert sum(timing.ended for timing in timings) + never == pytest.approx(1.0)
    hits = (data[..., 3] == 1).mean()
    assert 0 < hits <= timings[1].ended, "rays that hit end in the last level"


def test_stopping_a_training_ends_its_process_and_removes_its_model(
    open_desk: Callable[..., Desk], tmp_path: Path
) -> None:
    desk = open_desk()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    drop(desk, [tmp_path / "shape.obj"])
    training = desk.work.training
    assert training is not None
    desk.tick(AREA)
    assert training.running
    desk.work.stop_training()
    assert not training.running
    assert not training.model.parent.exists()


def test_the_user_is_told_why_a_broken_mesh_is_not_trained(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    desk = open_desk()
    (tmp_path / "broken.ply").write_bytes(b"ply\nnothing")
    drop(desk, [tmp_path / "broken.ply"])
    settle(desk, lambda: desk.work.training is None and "broken.ply" in desk.message)


def test_a_mesh_is_trained_and_its_model_shown(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    desk = open_desk()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    desk.work.train([tmp_path / "shape.obj"], ("--levels", "8x1,8x1", "--steps", "60,60"))
    seen = set()

    def done() -> bool:
        seen.add((desk.shown.source.name, desk.shown.view.levels))
        return desk.work.training is None

    settle(desk, done, seconds=60.0)
    assert "is trained" in desk.message
    assert desk.shown.source.name == "shape.obj"
    assert desk.shown.view.levels == 2
    assert desk.shown.source.model is not None
    assert not desk.shown.source.model.provenance["interrupted"]


def test_dropped_checkpoints_are_imported(open_desk: Callable[..., Desk], tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    model, paths = fitted_model((20, 32)), []
    for name, level in zip(("fine", "coarse"), reversed(model.levels), strict=True):
        state = {
            f"net.{i}.0.{kind}": torch.from_numpy(getattr(layer, kind).copy())
            for i, layer in enumerate(level.network)
            for kind in ("weight", "bias")
        }
        paths.append(tmp_path / f"{name}.pth")
        torch.save(state, paths[-1])
    desk = open_desk()
    drop(desk, paths)
    settle(desk, lambda: desk.work.training is None)
    assert "imported" in desk.message
    assert desk.shown.source.model is not None
    for ours, theirs in zip(desk.shown.source.model.levels, model.levels, strict=True):
        np.testing.assert_array_equal(ours.network[0].weight, theirs.network[0].weight)
