"""The bounds of sphere tracing's steps, measured on fields whose distance is a formula."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mplicits.trainer.measuring_config import TracingConfig
from mplicits.trainer.tracing import Tracing, trace

TRACING = TracingConfig()
THIN = 0.01
"""Half the thickness of the plate, model units."""


def plate(points: Tensor) -> Tensor:
    """Compute the distance to the plate |z| < THIN."""
    return points[:, 2].abs() - THIN


def ball(points: Tensor) -> Tensor:
    """Compute the distance to a ball of radius 0.6."""
    distance: Tensor = torch.linalg.vector_norm(points, dim=1) - 0.6
    return distance


def traced(distance: Callable[[Tensor], Tensor], scale: float, *deltas: float) -> Tracing:
    """Measure the field `scale` times a distance, the same at each of as many levels as there are deltas."""

    def field(points: Tensor) -> tuple[Tensor, Tensor]:
        f, reached = scale * distance(points), torch.ones(len(points), dtype=torch.int64)
        for delta in deltas[:-1]:
            reached += f.abs() < delta
        return f, reached

    def gradient(points: Tensor) -> Tensor:
        points = points.clone().requires_grad_()
        return torch.autograd.grad(field(points)[0].sum(), points)[0]

    points = 2 * torch.rand(4000, 3, generator=torch.Generator().manual_seed(0)) - 1
    points = points * torch.tensor([1.0, 1.0, 0.0])
    return trace(field, gradient, deltas, points[torch.linalg.vector_norm(points, dim=1) < 1])


@pytest.mark.parametrize("distance", [plate, ball])
def test_an_exact_distance_allows_whole_steps(distance: Callable[[Tensor], Tensor]) -> None:
    measured = traced(distance, 1.0, 0.05)
    assert measured.step_bounds == [1]
    assert measured.lipschitz == pytest.approx(1, abs=1e-5)


def test_a_field_of_half_more_than_the_distance_allows_two_thirds_of_a_step_before_a_thin_plate() -> None:
    measured = traced(plate, 1.5, 0.05)
    assert measured.step_bounds == [pytest.approx(2 / 3, abs=0.01)]
    assert measured.lipschitz == pytest.approx(1.5, abs=1e-5)


def test_such_a_field_allows_whole_steps_before_a_thick_ball() -> None:
    """A step that is too long ends inside the ball, and the next one leads back."""
    assert traced(ball, 1.5, 0.05).step_bounds == [1]


def test_a_band_takes_its_offset_off_the_step() -> None:
    """The longest step towards the plate begins at the ball's edge, z = 1.05: 1.5 (1.05 - THIN) less the offset."""
    band, last = traced(plate, 1.5, 0.3, 0.05).step_bounds
    inside = 2 * THIN * TRACING.inside
    assert band == pytest.approx((1.05 - THIN + inside) / (1.5 * (1.05 - THIN) - 0.3 / 1.3), abs=0.02)
    # In the band |f| < 0.3, the last level steps from z = 0.2 + THIN at most.
    assert last == pytest.approx((0.2 + inside) / 0.3, abs=0.02)


def test_a_broken_field_gets_the_least_bound() -> None:
    assert traced(plate, 5.0, 0.05).step_bounds == [TRACING.least_bound]
