"""The floor's shadow against many traced rays of light: its error, and that its edge has no ripples."""

import numpy as np
import pytest

from mplicits.field.lowest import lowest_point
from mplicits.field.openness import openness
from mplicits.ir.lower import lower
from mplicits.model.gallery import model_path
from mplicits.model.model_file import load
from mplicits.model.srgb import to_srgb
from oracles.disk_of_light import falls, lines_across, visible_share

HEIGHT, AROUND = 0.59588, 0.80308
"""Height of the direction to the key light, and the length of its horizontal part (glsl/functions/key_light.glsl)."""
TURN = 32.0
"""Degrees from the camera's azimuth to the light's, to the left."""


def shades(key: np.ndarray) -> np.ndarray:
    """Return the white floor's sRGB, 0 to 255, where the whole sky is visible (glsl/functions/floor_color.glsl)."""
    return np.asarray(255 * to_srgb((0.9 * HEIGHT * key + 0.45) / (0.9 * HEIGHT + 0.45)))


@pytest.mark.parametrize(
    ("name", "root_mean_square", "largest", "step_back"),
    [
        ("spot-small", 2.5, 8, 1.5),
        pytest.param("spot", 2.5, 8, 1.8, marks=pytest.mark.slow),
        pytest.param("bob", 2.5, 8, 1.5, marks=pytest.mark.slow),
        pytest.param("bob-small", 2.6, 8.5, 1.5, marks=pytest.mark.slow),
    ],
)
def test_the_floor_s_shadow_is_that_of_many_rays_and_has_no_ripples(
    name: str, root_mean_square: float, largest: float, step_back: float
) -> None:
    model = load(model_path(name))
    program = lower(model)
    assert model.front is not None
    azimuth = np.radians(model.front[0] - TURN)
    light = np.array((AROUND * np.sin(azimuth), HEIGHT, AROUND * np.cos(azimuth)))
    ground = lowest_point(program)
    lines = lines_across(light, ground, 8, 50)
    points = lines.reshape(-1, 3)
    up = np.tile((0.0, 1.0, 0.0), (len(points), 1))
    truth = visible_share(program, points, light).reshape(lines.shape[:2])
    drawn = openness(program, points, up, light, ground, True)[:, 1].reshape(lines.shape[:2])
    edge = (truth > 0.002) & (truth < 0.998)
    assert edge.sum() > 50
    error = shades(drawn) - shades(truth)
    assert np.sqrt((error[edge] ** 2).mean()) < root_mean_square
    assert np.abs(error).max() < largest
    rises = falls(shades(truth)) < 0.5
    assert rises.sum() >= 4
    assert falls(shades(drawn))[rises].max() < step_back
    assert drawn[:, -1].min() == 1, "it ends before the lines do"
