"""The field's figures as a distance, of a model whose error is known: a plane, moved by a constant."""

import numpy as np
import pytest
import trimesh

from mplicits.mesher.distance import compare_field
from mplicits.mesher.read_meshes import in_model_space
from mplicits.model.model import Layer, Level, Model

MOVED = 0.02


def plane() -> Model:
    """One level, f(x, y, z) = x + MOVED to six digits."""
    frequency = 0.01
    first = Layer(np.array([[frequency, 0, 0]], np.float32), np.zeros(1, np.float32))
    last = Layer(np.array([[1 / frequency]], np.float32), np.array([MOVED], np.float32))
    return Model("plane", (Level((first, last), 0.05, 20),))


def test_the_figures_are_those_of_the_formula() -> None:
    box = trimesh.creation.box((4.0, 8.0, 8.0))
    box.apply_translation((-2.0, 0.0, 0.0))
    truth = in_model_space(box, (0.0, 0.0, 0.0), 1.0)
    figures = compare_field(plane(), truth, 40_000)
    assert figures.domain_error == pytest.approx(MOVED, rel=1e-3)
    # x + 0.02 exceeds 1.05 |x| + 0.001 from x = -0.0093 to 0.38: a slice of the ball.
    low, high = -0.019 / 2.05, 0.38
    share = 0.75 * (high - low) - (high**3 - low**3) / 4
    assert figures.domain_excess == pytest.approx(share, abs=0.01)
    assert figures.band_error == pytest.approx(MOVED, rel=0.05), "near the box's edges it is not"
    assert figures.gradient == pytest.approx((1.0, 1.0, 1.0), abs=1e-3)
    assert figures == compare_field(plane(), truth, 40_000), "the seed decides all points"
