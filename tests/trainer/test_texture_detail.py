"""The detail of colors: its length, and the weights that hold it."""

import numpy as np
import pytest

from mplicits.trainer.shapes.shape import Doubles, unit
from mplicits.trainer.texture_detail import detail, detail_line, weights_of

POINTS = unit(np.random.default_rng(0).normal(size=(60_000, 3)))


def checked(cells: float) -> Doubles:
    """Colors of a checkerboard of cubes with sides of 1 / cells."""
    parity = np.floor(POINTS * cells).sum(axis=1) % 2
    return np.repeat(parity[:, None], 3, axis=1)


@pytest.mark.parametrize("cells", [20.0, 30.0])
def test_the_length_is_a_share_of_the_cells(cells: float) -> None:
    length, area = detail(POINTS, checked(cells))
    assert area == pytest.approx(4 * np.pi, rel=0.05)
    assert 0.1 / cells < length < 0.6 / cells


def test_smooth_and_single_colors_need_no_more() -> None:
    for colors in (0.5 + 0.4 * POINTS, np.full((60_000, 3), 0.3)):
        assert detail_line(POINTS, colors, (64, 2)) == ""


def test_the_line_names_a_network_that_suffices() -> None:
    line = detail_line(POINTS, checked(20.0), (64, 2))
    assert line.startswith("colors have details of 0.0")
    assert "64x2 (8,771 weights) blurs" in line
    width = int(line.rpartition(" ")[2].removesuffix("x2"))
    assert detail_line(POINTS, checked(20.0), (width, 2)) == ""
    assert (
        weights_of((width - 16, 2))
        < float(line.split("some ")[1].split()[0].replace(",", ""))
        <= weights_of((width, 2))
    )
