"""`--levels auto`: a budget or an error decides the width, and trials choose the frequencies."""

import re
import time
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.model_file import load
from mplicits.trainer import automatic
from mplicits.trainer.config import AutomaticConfig, DefaultLengths, TrainingConfig
from mplicits.trainer.level_goal import BYTES, HEADER, level_goal, parameters_of_width
from mplicits.trainer.networks.network import initial
from mplicits.trainer.options import TrainOptions
from mplicits.trainer.settings import networks
from mplicits.trainer.shapes.demo import DemoShape
from support.ball_training import QUICK, use_quick_config

CONFIG = TrainingConfig()
AUTOMATIC = CONFIG.automatic


@pytest.mark.parametrize("width", [8, 64, 200])
def test_sizes_are_those_of_networks(width: int) -> None:
    import torch

    generator = torch.Generator().manual_seed(0)
    levels = networks(f"{width}x1,{width}x2")
    count = sum(w.numel() for level in levels for w in initial(level, 30.0, 1, generator))
    assert parameters_of_width(width, textured=False) == count
    texture = initial((min(width, 64), 2), 30.0, 3, generator)
    assert parameters_of_width(width, textured=True) == count + sum(w.numel() for w in texture)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((None, None, None), "there is none"),
        ((1000, None, 1e-3), "there is --parameters and --error"),
        ((10, None, None), "--parameters: 10 parameters; from"),
        ((None, 1.0, None), "--kilobytes"),
        ((None, None, 0.5), "--error 0.5"),
    ],
)
def test_impossible_goals_are_refused(given: tuple[int | None, float | None, float | None], said: str) -> None:
    with pytest.raises(UserError, match=said):
        level_goal(*given, automatic=True)


def test_a_budget_of_bytes_is_one_of_parameters() -> None:
    wanted = level_goal(None, 60.0, None, automatic=True)
    assert wanted is not None
    assert wanted.parameters is not None
    assert wanted.parameters == pytest.approx((60_000 - HEADER) / BYTES, abs=1)
    width = automatic._largest_width(wanted.parameters, False, AUTOMATIC.width_step)
    wider = width + AUTOMATIC.width_step
    assert parameters_of_width(width, textured=False) <= wanted.parameters < parameters_of_width(wider, textured=False)


def test_the_error_goal_decides_the_width() -> None:
    sizes = [parameters_of_width(w, textured=False) for w in (*AUTOMATIC.trial_widths, 100)]
    *trials, (_, error) = [(count, 0.02 * count**-0.4) for count in sizes]
    error *= AUTOMATIC.improvement
    assert automatic._width_for_error(trials, error * 1.0001, CONFIG)[0] == 100
    with pytest.raises(UserError, match="not even 512x1,512x2"):
        automatic._width_for_error(trials, 1e-5, CONFIG)


def test_trials_leave_half_of_the_seconds_to_the_training(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, said = [], []

    def trial(shape: object, settings: object, width: int, factor: float, *_: object) -> float:
        tried.append(factor)
        return 1e-3 / factor

    class Progress:
        def say(self, line: str) -> None:
            said.append(line)

    monkeypatch.setattr(automatic, "_trial", trial)
    settings = TrainOptions("auto", parameters=5000, seconds=200).settings()
    assert settings.wish is not None
    shape, progress = DemoShape(), Progress()
    now = time.perf_counter()
    chosen = automatic.choose_levels(shape, settings, settings.wish, progress, now)  # type: ignore[arg-type]
    assert sorted(tried) == sorted(AUTOMATIC.factors)
    assert "1.4 times" in said[-1]
    usual = automatic.choose_levels(shape, settings, settings.wish, progress, now - 150)  # type: ignore[arg-type]
    assert len(tried) == len(AUTOMATIC.factors)
    assert "no seconds were left" in said[-1]
    assert chosen.networks == usual.networks
    assert chosen.omegas[0] == pytest.approx(1.4 * usual.omegas[0], abs=0.1)


def test_an_error_goal_repeats_no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def trial(shape: object, settings: object, width: int, factor: float, *_: object) -> float:
        tried.append((width, factor))
        return 0.1 / width

    class Progress:
        def say(self, line: str) -> None:
            """Ignore the line."""

    monkeypatch.setattr(automatic, "_trial", trial)
    settings = TrainOptions("auto", error=5e-4).settings()
    assert settings.wish is not None
    automatic.choose_levels(DemoShape(), settings, settings.wish, Progress(), 0.0)  # type: ignore[arg-type]
    assert (56, 1.0) in tried
    assert len(tried) == len(set(tried)) == 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "option", "budget"), [("demo", "--parameters", 3000), ("ball.ply", "--kilobytes", 14)]
)
def test_a_trained_model_keeps_to_its_budget_and_the_log_says_why(
    shape: str,
    option: str,
    budget: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    lengths, trials = DefaultLengths(steps=(60, 60), texture_steps=20), AutomaticConfig(trial_steps=(40, 40))
    use_quick_config(monkeypatch)
    monkeypatch.setattr("mplicits.trainer.config.DEFAULT", replace(QUICK, lengths=lengths, automatic=trials))
    trimesh.creation.icosphere(subdivisions=3).export("ball.ply")
    argv = ["train", shape, "--levels", "auto", option, str(budget), "-o", "m.safetensors", "--quiet"]
    assert cli.main(argv) == 0

    model = load(Path("m.safetensors"))
    spent = model.parameters() if option == "--parameters" else Path("m.safetensors").stat().st_size / 1000
    assert spent <= budget
    assert spent > 0.7 * budget
    assert (model.texture is not None) == (shape == "demo")
    said = capsys.readouterr().err
    width = model.levels[0].network[0].weight.shape[0]
    assert f"levels: {width}x1,{width}x2, for " in said
    omegas = ", ".join(f"{omega:g}" for omega in model.provenance["settings"]["omegas"])
    assert re.search(rf"omega: {omegas}; mean \|f\| of trials: .* with 1 times, .* with 0.7 times, ", said)
