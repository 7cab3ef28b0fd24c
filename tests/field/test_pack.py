"""Packing keeps a model's surface within limits, in a file of a quarter of the bytes."""

from pathlib import Path

import numpy as np
import pytest

from mplicits import cli
from mplicits.field import interpret
from mplicits.field.surface_points import near_surface
from mplicits.ir.lower import lower
from mplicits.model.model_file import load, save
from support.paths import DEMO
from support.random_model import random_model


@pytest.mark.slow
def test_pack_keeps_the_surface(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "packed.safetensors"
    assert cli.main(["pack", str(DEMO), "-o", str(path), "--bits", "7"]) == 0
    line = capsys.readouterr().out
    assert len(line.splitlines()) == 1
    model, exact = load(path), load(DEMO)
    size = path.stat().st_size
    assert f"{size:,} bytes instead of {DEMO.stat().st_size:,}" in line
    assert size < DEMO.stat().st_size / 3
    points = near_surface(lower(exact))
    values = [interpret.field(lower(each), points, len(exact.levels)) for each in (model, exact)]
    assert np.abs(values[0] - values[1]).mean() < 0.1 * exact.levels[-1].delta
    assert all(new.delta != old.delta for new, old in zip(model.levels, exact.levels, strict=True))


@pytest.mark.parametrize(
    ("argv", "said"),
    [(["--bits", "many"], "--bits many: auto, or a number"), (["--bits", "nan"], "--bits"), ([], "moving models")],
)
def test_what_is_not_packed_is_refused(
    argv: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "moving.safetensors"
    save(random_model((4, 0), inputs="xyzt"), path)
    assert cli.main(["pack", str(path), "-o", str(tmp_path / "p.safetensors"), *argv]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "p.safetensors").exists()
