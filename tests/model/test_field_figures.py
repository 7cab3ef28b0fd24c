"""The errors of a field as a distance, on samples with known errors."""

import numpy as np
import pytest

from mplicits.model.field_figures import field_figures, written


def test_the_figures_equal_their_formulas() -> None:
    distance = np.linspace(-0.5, 0.5, 101)
    f = np.where(distance > 0.25, 1.2, 0.9) * distance
    lengths = np.linspace(0, 1, 101, dtype=np.float32)
    gradients = np.stack((lengths, np.zeros_like(lengths), np.zeros_like(lengths)), axis=1)
    figures = field_figures((f, distance), (distance + 0.25, distance), gradients)
    assert figures.domain_error == pytest.approx(np.abs(f - distance).mean())
    assert figures.domain_excess == pytest.approx((distance > 0.25).mean())
    assert figures.band_error == pytest.approx(0.25)
    assert figures.gradient == pytest.approx((0.1, 0.5, 0.9))


def test_a_tenth_of_a_percent_of_the_sphere_is_no_excess() -> None:
    distance = np.array([0.0, 1e-4, 0.1])
    assert (
        field_figures((distance + 9e-4, distance), (distance, distance), np.ones((3, 3), np.float32)).domain_excess == 0
    )


def test_figures_without_a_known_distance_are_none() -> None:
    empty = np.empty(0)
    figures = field_figures((empty, empty), (empty, empty), np.ones((3, 3), np.float32))
    assert (figures.domain_error, figures.domain_excess, figures.band_error) == (None, None, None)
    assert (written(None, ".2e"), written(0.012, ".2e"), written(0.0, ".2%")) == ("not known", "1.20e-02", "0.00%")
