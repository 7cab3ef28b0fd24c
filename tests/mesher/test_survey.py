"""The line about a model's surface that a training ends with."""

import numpy as np
import pytest

from mplicits.mesher.survey import describe_surface
from mplicits.model.model import Layer, Level, Model


def slabs(omega: float, offset: float) -> Model:
    """One level, f(x, y, z) = (sin(omega x) + offset) / omega: slabs between planes across x."""
    first = Layer(np.array([[omega, 0, 0]], np.float32), np.zeros(1, np.float32))
    last = Layer(np.array([[1 / omega]], np.float32), np.array([offset / omega], np.float32))
    return Model("slabs", (Level((first, last), 0.05, 20),))


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Survey on a coarse grid, which is enough for slabs."""
    monkeypatch.setattr("mplicits.mesher.survey.RESOLUTION", 32)


@pytest.mark.parametrize(("omega", "count"), [(3.0, "1 closed component ("), (8.0, "3 closed components (")])
def test_components_are_counted(omega: float, count: str) -> None:
    assert describe_surface(slabs(omega, 0.0), quiet=True).startswith(f"surface: {count}")


def test_a_model_without_a_surface_is_described_too() -> None:
    assert describe_surface(slabs(4.0, 2.0), quiet=True).startswith("surface: the model has no surface")
