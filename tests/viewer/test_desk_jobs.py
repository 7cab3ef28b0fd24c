"""The desk's work: exports, videos, costs, training."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from mplicits.codegen.targets.registry import TARGETS
from mplicits.model.model import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.screenshot import to_png
from mplicits.viewer.state import jobs
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.picture import Scene
from mplicits.viewer.window.drop import drop
from numpy.typing import NDArray
from PIL import Image

from support.desk_fixture import AREA, TETRAHEDRON, settle, shown
from support.fitted_model import fitted_model


def test_exports(make: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    desk = make(samples=2)
    settle(desk)
    model = desk.source.model
    assert model is not None
    for name in ("model", *TARGETS):
        path = jobs.free_path("export", f".{name}")
        desk.begin(jobs.target(name, model, path))
        settle(desk, lambda: desk.job is None)
        assert desk.message == f"saved {path}"
        if name == "model":
            assert load(path).name == "two"
        else:
            assert path.read_text(encoding="utf-8") == TARGETS[name](model)
    size, camera, path = (600, 20), replace(desk.view.camera, aspect=30.0), jobs.free_path("export", ".png")
    desk.begin(jobs.picture(desk.renderer, path, Scene(size, camera, desk.view.options), "two"))
    settle(desk, lambda: desk.job is None)
    wanted = desk.renderer.render(size, camera, desk.view.options)[..., :3]
    assert np.abs(np.asarray(Image.open(path)) / 255 - wanted).max() < 0.6 / 255
    assert jobs.free_path("export", ".png") == Path("export-2.png")
    assert jobs.free_path("../a b", ".png") == Path("a-b.png")


def test_while_a_png_is_encoded_the_window_goes_on(
    make: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    go = Event()

    def slow(image: NDArray[np.float32], title: str) -> bytes:
        assert go.wait(60.0)
        return to_png(image, title)

    monkeypatch.setattr("mplicits.viewer.state.jobs.to_png", slow)
    desk, path = make(), tmp_path / "p.png"
    settle(desk)
    for cancelled in (True, False):
        go.clear()
        desk.begin(
            jobs.picture(desk.renderer, path, Scene(AREA, desk.view.camera, desk.view.options), "two"), draws=True
        )
        while not desk.doing[1].startswith("writing"):
            desk.tick(AREA)
        before = shown(desk)
        desk.view.turn(0.2, 0.0)
        for _ in range(50):
            desk.tick(AREA)
        assert np.abs(shown(desk) - before).max() > 0.1
        desk.cancel(drawing=not cancelled)
        go.set()
        settle(desk)
        assert path.exists() is not cancelled


def test_a_turntable_video(make: Callable[..., Desk], tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="PyAV is not installed (extra view)")
    desk, path = make(), tmp_path / "turn.mp4"
    desk.begin(
        jobs.Turntable((32, 24), seconds=0.4, rate=10).job(
            desk.renderer, path, Scene(AREA, Camera(), desk.view.options)
        )
    )
    settle(desk, lambda: desk.job is None)
    with av.open(str(path)) as video:
        pictures = [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]
    assert len(pictures) == 4
    grey = [
        desk.renderer.render((32, 24), Camera(aspect=4 / 3).orbited(90.0 * k, 0.0), desk.view.options)[..., 1]
        for k in range(4)
    ]
    for k, picture in enumerate(pictures):
        off = [np.abs(picture.mean(axis=-1) / 255 - other).mean() for other in grey]
        assert off.index(min(off)) == k
    assert list(tmp_path.glob(".*")) == []


def test_costs_of_the_levels(make: Callable[..., Desk]) -> None:
    desk = make()
    found: list[jobs.Cost] = []
    desk.begin(jobs.costs(desk.renderer, AREA, desk.view.camera, desk.view.options, found.extend))
    settle(desk, lambda: desk.job is None)
    data = desk.renderer.render(AREA, desk.view.camera, RenderOptions(shading="data"))
    assert len(found) == 2
    assert all(cost.milliseconds > 0 for cost in found)
    assert found[1].steps == pytest.approx(data[..., 1].mean())
    never = (data[..., 1] == 0).mean()
    assert sum(cost.ended for cost in found) + never == pytest.approx(1.0)
    hits = (data[..., 3] == 1).mean()
    assert 0 < hits <= found[1].ended, "who hits ends in the last level"


def test_closing_while_training_ends_the_training(make: Callable[..., Desk], tmp_path: Path) -> None:
    desk = make()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    drop(desk, [tmp_path / "shape.obj"])
    training = desk.training
    assert training is not None
    desk.tick(AREA)
    assert training.running
    desk.stop_training()
    assert not training.running
    assert not training.model.parent.exists()


def test_a_broken_mesh_is_told(make: Callable[..., Desk], tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    desk = make()
    (tmp_path / "broken.ply").write_bytes(b"ply\nnothing")
    drop(desk, [tmp_path / "broken.ply"])
    settle(desk, lambda: desk.training is None and "broken.ply" in desk.message)


def test_a_dropped_mesh_is_trained_and_appears_level_by_level(make: Callable[..., Desk], tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    desk = make()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    desk.train([tmp_path / "shape.obj"], ("--levels", "8x1,8x1", "--steps", "60,60"))
    seen = set()

    def done() -> bool:
        seen.add((desk.source.name, desk.view.levels))
        return desk.training is None

    settle(desk, done, seconds=60.0)
    assert "is trained" in desk.message
    assert desk.source.name == "shape.obj"
    assert desk.view.levels == 2
    assert desk.source.model is not None
    assert not desk.source.model.provenance["interrupted"]


def test_dropped_checkpoints_are_imported(make: Callable[..., Desk], tmp_path: Path) -> None:
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
    desk = make()
    drop(desk, paths)
    settle(desk, lambda: desk.training is None)
    assert "imported" in desk.message
    assert desk.source.model is not None
    for ours, theirs in zip(desk.source.model.levels, model.levels, strict=True):
        np.testing.assert_array_equal(ours.network[0].weight, theirs.network[0].weight)
