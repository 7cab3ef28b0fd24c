"""The work beside the picture: exports, videos, timings of the levels, training."""

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
from mplicits.viewer.state.exports import free_path
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from support import needs
from support.fitted_model import fitted_model
from support.viewer_fixture import AREA, TETRAHEDRON, OpenViewer, picture_of, settle


def test_exports_match_the_command_line(
    open_viewer: OpenViewer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    viewer = open_viewer(samples=2)
    settle(viewer)
    model = viewer.source.model
    assert model is not None
    for name in ("model", "c", "html"):
        path = free_path("export", f".{name}")
        viewer.work.begin(jobs.write_target(name, model, path))
        settle(viewer, lambda: viewer.work.job is None)
        assert viewer.message == f"saved {path}"
        if name == "model":
            assert load(path).name == "two"
        else:
            assert path.read_text(encoding="utf-8") == TARGETS[name](model)
    size, camera, path = (600, 20), replace(viewer.view.camera, aspect=30.0), free_path("export", ".png")
    viewer.work.begin(jobs.write_picture(viewer.renderer, path, Scene(size, camera, viewer.view.options), "two"))
    settle(viewer, lambda: viewer.work.job is None)
    rendered = viewer.renderer.render(size, camera, viewer.view.options)[..., :3]
    assert np.abs(np.asarray(Image.open(path)) / 255 - rendered).max() < 1.1 / 255
    assert free_path("export", ".png") == Path("export-2.png")
    assert free_path("../a b", ".png") == Path("a-b.png")


def test_the_viewer_draws_while_a_png_is_encoded(
    open_viewer: OpenViewer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_encode = Event()

    def slow(image: NDArray[np.float32], title: str) -> bytes:
        assert may_encode.wait(300.0)
        return to_png(image, title)

    monkeypatch.setattr("mplicits.viewer.state.jobs.to_png", slow)
    viewer, path = open_viewer(), tmp_path / "p.png"
    settle(viewer)
    for cancelled in (True, False):
        may_encode.clear()
        scene = Scene(AREA, viewer.view.camera, viewer.view.options)
        viewer.work.begin(jobs.write_picture(viewer.renderer, path, scene, "two"), draws=True)
        while not viewer.work.job_progress[1].startswith("writing"):
            viewer.tick(AREA)
        before = picture_of(viewer)
        viewer.view.turn(0.2, 0.0)
        for _ in range(50):
            viewer.tick(AREA)
        assert np.abs(picture_of(viewer) - before).max() > 0.1
        if cancelled:
            viewer.work.cancel()
        else:
            viewer.work.cancel_drawing()
        may_encode.set()
        settle(viewer)
        assert path.exists() is not cancelled


def test_a_turntable_video_shows_one_turn(open_viewer: OpenViewer, tmp_path: Path) -> None:
    av = needs.package("av")
    viewer, path = open_viewer(), tmp_path / "turn.mp4"
    viewer.work.begin(
        jobs.write_video(
            viewer.renderer, path, Scene(AREA, Camera(), viewer.view.options), (32, 24), seconds=0.4, rate=10
        )
    )
    settle(viewer, lambda: viewer.work.job is None)
    with av.open(str(path)) as video:
        pictures = [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]
    assert len(pictures) == 4
    options = viewer.view.options
    gray = [
        viewer.renderer.render((32, 24), Camera(aspect=4 / 3).orbited(90.0 * k, 0.0), options)[..., 1] for k in range(4)
    ]
    for k, picture in enumerate(pictures):
        off = [np.abs(picture.mean(axis=-1) / 255 - other).mean() for other in gray]
        assert off.index(min(off)) == k
    assert list(tmp_path.glob(".*")) == []


def test_level_timings_match_the_raw_data(open_viewer: OpenViewer) -> None:
    viewer = open_viewer()
    timings: list[jobs.LevelTiming] = []
    view = viewer.view
    viewer.work.begin(jobs.time_levels(viewer.renderer, AREA, view.camera, view.options, timings.extend))
    settle(viewer, lambda: viewer.work.job is None)
    data = viewer.renderer.render(AREA, view.camera, RenderOptions(shade="data"))
    assert len(timings) == 2
    assert all(timing.milliseconds > 0 for timing in timings)
    assert timings[1].steps == pytest.approx(data[..., 1].mean())
    never = (data[..., 1] == 0).mean()
    assert sum(timing.ended for timing in timings) + never == pytest.approx(1.0)
    hits = (data[..., 3] == 1).mean()
    assert 0 < hits <= timings[1].ended, "rays that hit end in the last level"


def test_stopping_a_training_ends_its_process_and_removes_its_model(open_viewer: OpenViewer, tmp_path: Path) -> None:
    viewer = open_viewer()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    drop(viewer, [tmp_path / "shape.obj"])
    training = viewer.work.training
    assert training is not None
    viewer.tick(AREA)
    assert training.running
    viewer.work.stop_training()
    assert not training.running
    assert not training.model.parent.exists()


def test_a_broken_mesh_is_reported(open_viewer: OpenViewer, tmp_path: Path) -> None:
    needs.package("torch")
    viewer = open_viewer()
    (tmp_path / "broken.ply").write_bytes(b"ply\nnothing")
    drop(viewer, [tmp_path / "broken.ply"])
    settle(viewer, lambda: viewer.work.training is None and "broken.ply" in viewer.message)


@pytest.mark.slow
def test_a_trained_model_is_shown(open_viewer: OpenViewer, tmp_path: Path) -> None:
    needs.package("torch")
    viewer = open_viewer()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    viewer.work.train([tmp_path / "shape.obj"], ("--levels", "8x1,8x1", "--steps", "60,60"))
    seen = set()

    def done() -> bool:
        seen.add((viewer.source.name, viewer.view.levels))
        return viewer.work.training is None

    settle(viewer, done)
    assert "is trained" in viewer.message
    assert viewer.source.name == "shape.obj"
    assert viewer.view.levels == 2
    assert viewer.source.model is not None
    assert not viewer.source.model.provenance["interrupted"]


@pytest.mark.slow
def test_dropped_checkpoints_are_imported(open_viewer: OpenViewer, tmp_path: Path) -> None:
    torch = needs.package("torch")
    model, paths = fitted_model((20, 32)), []
    for name, level in zip(("fine", "coarse"), reversed(model.levels), strict=True):
        state = {
            f"net.{i}.0.{kind}": torch.from_numpy(getattr(layer, kind).copy())
            for i, layer in enumerate(level.network)
            for kind in ("weight", "bias")
        }
        paths.append(tmp_path / f"{name}.pth")
        torch.save(state, paths[-1])
    viewer = open_viewer()
    drop(viewer, paths)
    settle(viewer, lambda: viewer.work.training is None)
    assert "imported" in viewer.message
    assert viewer.source.model is not None
    for ours, theirs in zip(viewer.source.model.levels, model.levels, strict=True):
        np.testing.assert_array_equal(ours.network[0].weight, theirs.network[0].weight)
