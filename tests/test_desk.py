"""The desk: what is drawn when, what happens to files that are opened, watched, dropped; jobs; training."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from codegen.glsl330 import standalone
from codegen.model import load, save
from codegen.targets import TARGETS
from random_model import random_model
from viewer import jobs
from viewer.camera import Camera
from viewer.context import Context
from viewer.desk import Desk
from viewer.options import RenderOptions
from viewer.source import open_source
from viewer.view import View

AREA = (24, 16)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture
def make(osmesa: Context, tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    desks = []

    def opened(watch: bool = False, **options: object) -> Desk:
        path = tmp_path / "two.safetensors"
        save(random_model((4, 0), (8, 0), texture=(4, 0), name="two"), path)
        source = open_source(path)
        view = View(Camera(), RenderOptions(**options), source.shader.levels, source.textured)  # type: ignore[arg-type]
        view.resize(AREA)
        desks.append(Desk(osmesa, source, view, watch=watch))
        return desks[-1]

    yield opened
    for desk in desks:
        desk.close()


def settle(desk: Desk, until: Callable[[], bool] = lambda: True, seconds: float = 60.0) -> int:
    """Ticks until nothing is due but a message's end; returns how many it took."""
    end, count = time.perf_counter() + seconds, 0
    while time.perf_counter() < end:
        due = desk.tick(AREA)
        count += 1
        if until() and desk.resting:
            return count
        time.sleep(min(0.02, due or 0.0))
    pytest.fail("it never comes to rest")


def is_open(desk: Desk, path: Path) -> bool:
    return desk.source.path == path


def shown(desk: Desk) -> np.ndarray:
    """(H, W, 3): the refined picture, top row first, in [0, 1]."""
    width, height = AREA
    with desk.context as gl:
        screen = gl.framebuffer([gl.texture(AREA, 4, dtype="f4")])
        desk.picture.show((0, 0), AREA, split=False, onto=screen)
        data = np.frombuffer(screen.read(components=3, dtype="f4"), np.float32)
        screen.color_attachments[0].release()
        screen.release()
    return data.reshape(height, width, 3)[::-1]


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
    desk.drop([tmp_path / "one.safetensors"])
    settle(desk, lambda: desk.source.name == "one")
    assert (desk.view.levels, desk.view.options.level) == (1, None)


@pytest.mark.parametrize(("name", "content", "reason"), [
    ("bad.safetensors", b"\0" * 40, "bad.safetensors"),
    ("bad.glsl", b"void main() {}", "LEVELS"),
    ("bad.glsl", b"\xff\xfe", "not text"),
    ("missing.safetensors", None, "missing.safetensors"),
    ("notes.txt", b"", "neither a model"),
])
def test_a_dropped_file_that_is_none_is_told(
    make: Callable[..., Desk], tmp_path: Path, name: str, content: bytes | None, reason: str
) -> None:
    desk = make()
    if content is not None:
        (tmp_path / name).write_bytes(content)
    desk.drop([tmp_path / name])
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
        assert np.quantile(np.abs(shown(desk) - before), 0.95) < 1e-3, "all but the silhouette, where sums round otherwise"


def test_watch_shows_the_new_file_and_keeps_the_picture_of_one_that_does_not_compile(
    make: Callable[..., Desk], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viewer.desk.LOOK", 0.01)
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
    import glsl

    desk = make()
    read = glsl.read
    wrong = read("march.glsl").replace("++ray.steps;", "++ray.steeps;")
    monkeypatch.setattr(glsl, "read", lambda name: wrong if name == "march.glsl" else read(name))
    desk.open(desk.source.path)
    settle(desk, lambda: bool(desk.log))
    line = next(k for k, text in enumerate(wrong.splitlines(), start=1) if "steeps" in text)
    assert f"march.glsl:{line}" in desk.log[0]


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
    desk.begin(jobs.picture(desk.renderer, path, size, camera, desk.view.options, "two"))
    settle(desk, lambda: desk.job is None)
    wanted = desk.renderer.render(size, camera, desk.view.options)[..., :3]
    assert np.abs(np.asarray(Image.open(path)) / 255 - wanted).max() < 0.6 / 255
    assert jobs.free_path("export", ".png") == Path("export-2.png")
    assert jobs.free_path("../a b", ".png") == Path("a-b.png")


def test_a_turntable_video(make: Callable[..., Desk], tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="PyAV is not installed (extra view)")
    desk, path = make(), tmp_path / "turn.mp4"
    desk.begin(jobs.Turntable((32, 24), seconds=0.4, rate=10).job(
        desk.renderer, path, Camera(aspect=4 / 3), desk.view.options))
    settle(desk, lambda: desk.job is None)
    with av.open(str(path)) as video:
        pictures = [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]
    assert len(pictures) == 4
    grey = [desk.renderer.render((32, 24), Camera(aspect=4 / 3).orbited(90.0 * k, 0.0), desk.view.options)[..., 1]
            for k in range(4)]
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
    desk.drop([tmp_path / "shape.obj"])
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
    desk.drop([tmp_path / "broken.ply"])
    settle(desk, lambda: desk.training is None and "broken.ply" in desk.message)


def test_a_dropped_mesh_is_trained_and_appears_level_by_level(make: Callable[..., Desk], tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    desk = make()
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    desk.train(tmp_path / "shape.obj", ("--levels", "8x1,8x1", "--steps", "60,60"))
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
