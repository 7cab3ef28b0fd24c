"""A model is read from its file as it was saved, and is checked when it is made."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mplicits.model.errors import UserError
from mplicits.model.model import DEFAULT_STEP_BOUND, Model
from mplicits.model.model_file import load, save
from support.paths import DEMO
from support.random_model import random_model

PLAIN = random_model((8, 1))
NASTY_NAMES = ['"/*', "</script>", "a\nb", "\r\n#version 100", "*/ }", "\u2028", "\udcff", "\\", "${x}", "é" * 300]


def bounded(model: Model, **bounds: float) -> Model:
    """Return a model with these step bounds at every level."""
    levels = tuple(dataclasses.replace(level, **bounds) for level in model.levels)  # type: ignore[arg-type]
    return dataclasses.replace(model, levels=levels)


def assert_same(a: Model, b: Model) -> None:
    """Fail unless two models are equal in every value."""
    assert a.sha256() == b.sha256()
    assert (a.name, a.inputs, a.place, a.provenance) == (b.name, b.inputs, b.place, b.provenance)
    assert (a.front, a.credit) == (b.front, b.credit)
    assert a.tensors().keys() == b.tensors().keys()
    for key, tensor in a.tensors().items():
        np.testing.assert_array_equal(tensor, b.tensors()[key])
    for one, other in zip(a.levels, b.levels, strict=True):
        assert (one.delta, one.iterations, one.lipschitz) == (other.delta, other.iterations, other.lipschitz)
        assert (one.step_bound, one.band_step_bound) == (other.step_bound, other.band_step_bound)


@pytest.mark.parametrize(
    "model",
    [
        random_model((8, 0)),
        random_model((8, 1), (12, 2), (16, 2), texture=(8, 1)),
        random_model((8, 1), inputs="xyzt"),
        dataclasses.replace(PLAIN, center=(1, -2.5, 3e-9), scale=17, provenance={"a": [None, "é"]}),
        dataclasses.replace(PLAIN, up="z", front=(-215, 15.5), credit="A. Author </script> \n*/"),
        bounded(random_model((8, 1), (8, 0)), step_bound=0.931, band_step_bound=1.0),
        bounded(PLAIN, step_bound=DEFAULT_STEP_BOUND, band_step_bound=0.7),
    ],
    ids=["one", "three-textured", "xyzt", "placed", "presented", "bounds", "band's bound"],
)
def test_a_saved_model_is_read_as_it_was(model: Model, tmp_path: Path) -> None:
    save(model, tmp_path / "m.safetensors")
    assert_same(load(tmp_path / "m.safetensors"), model)


@pytest.mark.parametrize("name", NASTY_NAMES)
def test_any_name_is_kept(name: str, tmp_path: Path) -> None:
    save(random_model((8, 1), name=name), tmp_path / "m.safetensors")
    assert load(tmp_path / "m.safetensors").name == name


def test_the_hash_covers_everything_that_changes_a_picture() -> None:
    model = random_model((8, 1), (12, 1), texture=(8, 1))
    same = dataclasses.replace(model, name="other", provenance={"a": 1}, scale=3.0, center=(1.0, 0.0, 0.0))
    assert same.sha256() == model.sha256()
    finer = dataclasses.replace(model.levels[1], delta=0.25)
    assert dataclasses.replace(model, levels=(model.levels[0], finer)).sha256() != model.sha256()
    assert bounded(model, step_bound=0.9).sha256() != model.sha256()
    assert bounded(model, band_step_bound=0.9).sha256() != model.sha256()
    assert dataclasses.replace(model, texture=None).sha256() != model.sha256()
    assert random_model((8, 1), (12, 1), texture=(8, 1), seed=1).sha256() != model.sha256()


def test_a_file_without_step_bounds_has_the_default_bounds(tmp_path: Path) -> None:
    """tests/data/demo.safetensors is such a file; its hash is as old as the file."""
    model = load(DEMO)
    assert {(level.step_bound, level.band_step_bound) for level in model.levels} == {(0.8, 0.8)}
    assert model.sha256().startswith("12706929a4eb")
    save(model, tmp_path / "m.safetensors")
    assert b"step_bound" not in (tmp_path / "m.safetensors").read_bytes()


@pytest.mark.parametrize(
    "change",
    [
        {"levels": (dataclasses.replace(PLAIN.levels[0], network=()),)},
        {"levels": (dataclasses.replace(PLAIN.levels[0], step_bound=1.01),)},
        {"center": (0.0, 0.0)},
        {"inputs": "xyzt"},
        {"provenance": {"path": Path()}},
    ],
)
def test_a_model_is_checked_when_it_is_made(change: dict[str, Any]) -> None:
    with pytest.raises(UserError):
        dataclasses.replace(PLAIN, **change)


def test_the_same_model_is_the_same_bytes(tmp_path: Path) -> None:
    model = random_model((4, 0), (8, 0), texture=(4, 0))
    written = []
    for number in range(8):
        save(model, tmp_path / f"{number}.safetensors")
        written.append((tmp_path / f"{number}.safetensors").read_bytes())
    assert len(set(written)) == 1
