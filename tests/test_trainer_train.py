"""Training from end to end, small: quality, nesting, repeatability, the clock, Ctrl-C, resuming, collapse."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from codegen.errors import UserError
from codegen.model import Model, load, save, shape_of
from trainer import bands, level, machine, pools
from trainer.load import load_shape
from trainer.network import from_model
from trainer.settings import Settings
from trainer.shape import Doubles, Shape
from trainer.train import Training

SMALL = Settings(networks=((16, 1), (16, 1)), omegas=(8.0, 16.0), steps=(250, 250, 100))


class Log:
    """Progress that keeps what is said, and can press Ctrl-C."""

    def __init__(self, stop_in: str = "", at: float = 2.0) -> None:
        self.lines: list[str] = []
        self.stages: list[str] = []
        self._stop_in, self._at = stop_in, at

    def begin(self, stage: str) -> None:
        self.stages.append(stage)

    def advance(self, fraction: float, loss: float) -> None:
        assert 0 <= fraction <= 1
        if fraction >= self._at and self.stages[-1].startswith(self._stop_in):
            raise KeyboardInterrupt

    def end(self) -> None:
        pass

    def say(self, line: str) -> None:
        self.lines.append(line)


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    machine.prepare(torch.device("cpu"))


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    path = tmp_path_factory.mktemp("ball") / "ball.ply"
    trimesh.creation.icosphere(subdivisions=4, radius=3.0).export(path)
    return load_shape(str(path))[0]


def train(shape: Shape, settings: Settings = SMALL, log: Log | None = None, resume: Model | None = None) -> Model:
    return Training(shape, settings, log or Log()).run(resume)


@pytest.fixture(scope="module")
def model(ball: Shape) -> Model:
    return train(ball)


@pytest.fixture(scope="module")
def first(ball: Shape) -> Model:
    """Level 1 alone."""
    return train(ball, dataclasses.replace(SMALL, networks=SMALL.networks[:1], omegas=SMALL.omegas[:1]))


def field(model: Model, points: Doubles, levels: int) -> Doubles:
    """The first `levels` levels in float32 numpy."""
    total = np.zeros(len(points))
    for part in model.levels[:levels]:
        hidden = points.astype(np.float32)
        for layer in part.network[:-1]:
            hidden = np.sin(hidden @ layer.weight.T + layer.bias)
        total += (hidden @ part.network[-1].weight.T + part.network[-1].bias)[:, 0]
    return total


def directions(count: int) -> Doubles:
    drawn = np.random.default_rng(7).normal(size=(count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def test_a_sphere_is_learnt(model: Model) -> None:
    """Level 1 in the whole ball, level 2 in its band, against |x| - 1."""
    points = directions(4000)
    radii = np.random.default_rng(8).uniform(0.6, 1, (4000, 1))
    assert np.abs(field(model, points * radii, 1) - (radii[:, 0] - 1)).mean() < 0.05
    assert np.abs(field(model, points, 2)).mean() < 3e-3
    assert model.scale == pytest.approx(3, rel=1e-3)


def test_figures_are_measured(model: Model) -> None:
    first, second = model.provenance["levels"]
    assert first["mean_f"] == pytest.approx(np.abs(field(model, directions(20_000), 1)).mean(), rel=0.3)
    assert second["mean_f"] < first["mean_f"]
    assert 0 < second["angle"] < first["angle"] < 20
    assert model.provenance["seed"] == 0
    assert model.provenance["source"]["file"] == "ball.ply"
    assert model.provenance["seconds"] > 0
    assert model.provenance["interrupted"] is False


def test_bands_hold_the_surface(ball: Shape, model: Model) -> None:
    """Eq. 5 and Eq. 3: every input point lies in every band, and the band is 1.3 times what it must be."""
    for i, part in enumerate(model.levels, start=1):
        largest = np.abs(field(model, ball.inputs(), i)).max()
        assert largest < part.delta
        drawn = np.abs(field(model, ball.surface(300_000, np.random.default_rng(5)).points, i)).max()
        assert part.delta == pytest.approx(1.3 * max(largest, drawn), rel=0.05)


def test_delta_is_equation_5() -> None:
    assert bands.delta(torch.tensor([0.01, -0.03, 0.02])) == pytest.approx(1.3 * 0.03)


def test_lipschitz_is_near_one_for_a_distance(model: Model) -> None:
    for part in model.levels:
        assert 0.9 < part.lipschitz < 2


def test_iterations_are_the_papers(model: Model) -> None:
    assert [part.iterations for part in model.levels] == [20, 5]


def test_the_file_keeps_everything(model: Model, tmp_path: Path) -> None:
    save(model, tmp_path / "ball.safetensors")
    again = load(tmp_path / "ball.safetensors")
    assert again.sha256() == model.sha256()
    assert again.provenance == model.provenance


def test_a_seed_gives_the_same_weights(ball: Shape, model: Model) -> None:
    assert train(ball).sha256() == model.sha256()
    assert train(ball, dataclasses.replace(SMALL, seed=1)).sha256() != model.sha256()


def test_three_levels(ball: Shape) -> None:
    settings = Settings(networks=((16, 1), (16, 1), (12, 0)), omegas=(8.0, 16.0, 24.0), steps=(120, 120, 120, 60))
    found = train(ball, settings)
    assert [shape_of(part.network) for part in found.levels] == ["16x1", "16x1", "12x0"]
    assert found.levels[0].delta > found.levels[2].delta


def test_frozen_levels_are_evaluated_once(ball: Shape, model: Model) -> None:
    """The pool's frozen value and gradient are those of the finished levels at its points."""
    frozen = [from_model(model.levels[0].network)]
    sampler = pools.Sampler(ball, frozen, model.levels[0].delta, torch.device("cpu"), np.random.default_rng(0))
    for pool in (sampler.surface(3000), sampler.volume(3000)):
        assert np.abs(field(model, pool.points.double().numpy(), 1) - pool.frozen.numpy()).max() < 1e-5
        assert pool.distance is not None
        exact = np.linalg.norm(pool.points.numpy(), axis=1) - 1
        assert np.abs(pool.distance.numpy() - exact).max() < 5e-3
    assert (pool.frozen.abs() < model.levels[0].delta).all()


def test_seconds_are_kept(ball: Shape) -> None:
    began = time.perf_counter()
    train(ball, dataclasses.replace(SMALL, seconds=8.0))
    assert time.perf_counter() - began == pytest.approx(8, rel=0.05)


def test_a_cloud_is_learnt(tmp_path: Path) -> None:
    normals = directions(6000)
    np.savez(tmp_path / "cloud.npz", points=5 * normals, normals=normals)
    shape, _ = load_shape(str(tmp_path / "cloud.npz"))
    found = train(shape)
    points = directions(3000)
    assert np.abs(field(found, points, 2)).mean() < 5e-3
    assert field(found, 0.5 * points, 1).max() < -0.3
    corners = np.random.default_rng(3).uniform(-1, 1, (3000, 3))
    assert field(found, corners[np.linalg.norm(corners, axis=1) > 1.15], 1).min() > 0


def test_colours_are_learnt(tmp_path: Path) -> None:
    normals = directions(6000)
    colours = np.where(normals[:, :1] > 0, (0.9, 0.1, 0.1), (0.1, 0.1, 0.9))
    np.savez(tmp_path / "cloud.npz", points=normals, normals=normals, colours=colours)
    shape, _ = load_shape(str(tmp_path / "cloud.npz"))
    settings = dataclasses.replace(SMALL, networks=((24, 1),), omegas=(8.0,), steps=(100, 400))
    found = train(shape, settings)
    assert found.texture is not None
    points = directions(2000)[np.abs(directions(2000)[:, 0]) > 0.2]
    hidden = points.astype(np.float32)
    for layer in found.texture[:-1]:
        hidden = np.sin(hidden @ layer.weight.T + layer.bias)
    learnt = hidden @ found.texture[-1].weight.T + found.texture[-1].bias
    assert np.abs(learnt - np.where(points[:, :1] > 0, (0.9, 0.1, 0.1), (0.1, 0.1, 0.9))).mean() < 0.06
    assert train(shape, dataclasses.replace(settings, texture=False)).texture is None


@pytest.mark.parametrize(("stage", "levels"), [("level 1", 1), ("level 2", 2)])
def test_ctrl_c_keeps_what_is_trained_and_resume_ends_it(
    ball: Shape, model: Model, stage: str, levels: int
) -> None:
    training = Training(ball, SMALL, Log(stage, 0.5))
    stopped = training.run()
    assert training.interrupted
    assert stopped.provenance["interrupted"]
    assert len(stopped.levels) == levels
    assert stopped.provenance["levels"][-1]["fraction"] == pytest.approx(0.5, abs=0.1)
    assert np.abs(field(stopped, ball.inputs(), levels)).max() < stopped.levels[-1].delta
    log = Log()
    resumed = train(ball, log=log, resume=stopped)
    assert log.stages[0].startswith(stage)
    assert len(resumed.levels) == 2
    assert not resumed.provenance["interrupted"]
    assert resumed.provenance["levels"][-1]["fraction"] == 1
    assert resumed.provenance["levels"][1]["mean_f"] < 2 * model.provenance["levels"][1]["mean_f"]


def test_ctrl_c_before_the_first_step_is_passed_on(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    def press(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pools.Sampler, "surface", press)
    with pytest.raises(KeyboardInterrupt):
        train(ball)


def test_resume_adds_missing_levels_alone(ball: Shape, model: Model) -> None:
    three = dataclasses.replace(SMALL, networks=(*SMALL.networks, (16, 0)), omegas=(8.0, 16.0, 24.0), steps=(50,) * 4)
    log = Log()
    longer = train(ball, three, log, model)
    assert [stage[:7] for stage in log.stages] == ["level 3"]
    for old, new in zip(model.levels, longer.levels, strict=False):
        assert all((a.weight == b.weight).all() for a, b in zip(old.network, new.network, strict=True))
    assert longer.provenance["seconds"] > model.provenance["seconds"]


def test_resume_refuses_another_shape_or_other_levels(ball: Shape, model: Model) -> None:
    with pytest.raises(UserError, match="another shape"):
        train(load_shape("demo")[0], resume=model)
    with pytest.raises(UserError, match="16x1,16x1"):
        train(ball, dataclasses.replace(SMALL, networks=((16, 2), (16, 1))), resume=model)
    with pytest.raises(UserError, match="does not say"):
        train(ball, resume=dataclasses.replace(model, provenance={}))


def test_a_collapsed_residual_is_restarted(ball: Shape, first: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rate a hundred times too high drives the residual to nothing good; the log says so and a lower one helps."""
    monkeypatch.setattr(level, "RATE", 100 * level.RATE)
    log = Log()
    found = train(ball, dataclasses.replace(SMALL, steps=(150, 300, 60)), log, first)
    assert any("restarted with rate" in line for line in log.lines)
    second = found.provenance["levels"][1]
    assert second["restarts"] == len([line for line in log.lines if "restarted" in line])
    assert second["rate"] < level.RATE
    assert second["mean_f"] < found.provenance["levels"][0]["mean_f"]


def test_a_residual_that_never_helps_ends_as_zero(ball: Shape, first: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(level, "RATE", 1e6)
    log = Log()
    found = train(ball, dataclasses.replace(SMALL, steps=(60, 100, 60)), log, first)
    assert any("adds nothing" in line for line in log.lines)
    assert not found.levels[1].network[-1].weight.any()
    assert found.provenance["levels"][1]["mean_f"] == found.provenance["levels"][0]["mean_f"]
