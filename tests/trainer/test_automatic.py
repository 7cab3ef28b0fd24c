"""`--levels auto`: a budget or an error becomes widths, and trials choose the frequencies."""

import re
import time
from pathlib import Path

import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.model_file import load
from mplicits.trainer import automatic, settings
from mplicits.trainer.automatic_wish import BYTES, HEADER, size, wish_of
from mplicits.trainer.networks.network import initial
from mplicits.trainer.options import settings_from
from mplicits.trainer.shapes.demo import DemoShape


@pytest.mark.parametrize("width", [8, 64, 200])
def test_sizes_are_those_of_networks(width: int) -> None:
    import torch

    generator = torch.Generator().manual_seed(0)
    levels = settings.networks(f"{width}x1,{width}x2")
    count = sum(w.numel() for level in levels for w in initial(level, 30.0, 1, generator))
    assert size(width, textured=False) == count
    texture = initial((min(width, 64), 2), 30.0, 3, generator)
    assert size(width, textured=True) == count + sum(w.numel() for w in texture)


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
def test_wishes_that_cannot_be_are_one_line(given: tuple[int | None, float | None, float | None], said: str) -> None:
    with pytest.raises(UserError, match=said):
        wish_of(*given, automatic=True)


def test_a_budget_of_bytes_is_one_of_parameters() -> None:
    wanted = wish_of(None, 60.0, None, automatic=True)
    assert wanted is not None
    assert wanted.parameters is not None
    assert wanted.parameters == pytest.approx((60_000 - HEADER) / BYTES, abs=1)
    width = automatic._widest(wanted.parameters, textured=False)
    assert size(width, textured=False) <= wanted.parameters < size(width + automatic.STEP, textured=False)


def test_the_error_that_is_wanted_decides_the_width() -> None:
    trials = [(size(w, textured=False), 0.02 * size(w, textured=False) ** -0.4) for w in automatic.TRIAL_WIDTHS]
    error = automatic.LONGER * 0.02 * size(100, textured=False) ** -0.4
    assert automatic._wide_enough(trials, error * 1.0001)[0] == 100
    with pytest.raises(UserError, match="not even 512x1,512x2"):
        automatic._wide_enough(trials, 1e-5)


def test_trials_leave_half_of_the_seconds_to_the_training(monkeypatch: pytest.MonkeyPatch) -> None:
    tried, said = [], []

    def trial(shape: object, asked: object, width: int, factor: float, progress: object) -> float:
        tried.append(factor)
        return 1e-3 / factor

    class Progress:
        def say(self, line: str) -> None:
            said.append(line)

    monkeypatch.setattr(automatic, "_trial", trial)
    asked = settings_from("auto", parameters=5000, seconds=200)
    assert asked.wish is not None
    shape, progress = DemoShape(), Progress()
    now = time.perf_counter()
    chosen = automatic.choose(shape, asked, asked.wish, progress, now)  # type: ignore[arg-type]
    assert sorted(tried) == sorted(automatic.FACTORS)
    assert "1.4 times" in said[-1]
    usual = automatic.choose(shape, asked, asked.wish, progress, now - 150)  # type: ignore[arg-type]
    assert len(tried) == len(automatic.FACTORS)
    assert "no seconds were left" in said[-1]
    assert chosen.networks == usual.networks
    assert chosen.omegas[0] == pytest.approx(1.4 * usual.omegas[0], abs=0.1)


def test_an_error_takes_no_trial_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def trial(shape: object, asked: object, width: int, factor: float, progress: object) -> float:
        tried.append((width, factor))
        return 0.1 / width

    class Progress:
        def say(self, line: str) -> None:
            """Nobody listens."""

    monkeypatch.setattr(automatic, "_trial", trial)
    asked = settings_from("auto", error=5e-4)
    assert asked.wish is not None
    automatic.choose(DemoShape(), asked, asked.wish, Progress(), 0.0)  # type: ignore[arg-type]
    assert (56, 1.0) in tried
    assert len(tried) == len(set(tried)) == 4


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["demo", "ball.ply"])
@pytest.mark.parametrize(("option", "budget"), [("--parameters", 3000), ("--kilobytes", 14)])
def test_a_trained_model_keeps_to_its_budget_and_the_log_says_why(
    shape: str,
    option: str,
    budget: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(settings, "STEPS", (60, 60))
    monkeypatch.setattr(settings, "TEXTURE_STEPS", 20)
    monkeypatch.setattr(automatic, "TRIAL_STEPS", "40,40")
    monkeypatch.setattr("mplicits.mesher.survey.RESOLUTION", 16)  # of what so few steps have learnt, the surface costs
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
