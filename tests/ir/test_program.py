"""Lowered programs in the NumPy interpreter compute the same as torch; rounding and costs."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from mplicits.codegen.printers.cstyle import Language
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.ir.program import Dot
from mplicits.model.model import Model, Network
from support import needs
from support.random_model import random_model

torch = needs.package("torch")

SHAPES = (((64, 1), (64, 2)), ((10, 1), (7, 0), (33, 2)))


def points(count: int = 1000) -> np.ndarray:
    """Return fixed random points, (count, 3) float32."""
    return np.random.default_rng(1).uniform(-1, 1, (count, 3)).astype(np.float32)


def torch_network(network: Network, x: Any) -> Any:
    """Evaluate a network with torch at inputs (N, 3) or (N, 4); returns (N, outputs)."""
    for layer in network[:-1]:
        x = torch.sin(torch.nn.functional.linear(x, torch.from_numpy(layer.weight), torch.from_numpy(layer.bias)))
    return torch.nn.functional.linear(x, torch.from_numpy(network[-1].weight), torch.from_numpy(network[-1].bias))


@pytest.mark.parametrize("shapes", SHAPES)
def test_the_interpreter_computes_the_same_as_torch(shapes: tuple[tuple[int, int], ...]) -> None:
    model = random_model(*shapes, texture=(12, 1))
    program = lower(model)
    for level in range(1, len(shapes) + 1):
        x = torch.from_numpy(points()).requires_grad_()
        value = sum(torch_network(numbers.network, x) for numbers in model.levels[:level])
        (gradient,) = torch.autograd.grad(value.sum(), x)
        ours, f = interpret.field_gradient(program, points(), level)
        scale = float(gradient.abs().max())
        np.testing.assert_allclose(interpret.field(program, points(), level), value.detach()[:, 0], atol=1e-5)
        np.testing.assert_allclose(f, value.detach()[:, 0], atol=1e-5)
        np.testing.assert_allclose(ours, gradient, atol=1e-5 * scale)
    assert model.texture is not None
    color = torch_network(model.texture, torch.from_numpy(points())).clamp(0, 1)
    np.testing.assert_allclose(interpret.color(program, points()), color, atol=1e-5)


def test_time_is_the_fourth_input() -> None:
    model = random_model((16, 1), inputs="xyzt")
    x = np.concatenate([points(), np.full((1000, 1), 0.3, np.float32)], axis=1)
    expected = torch_network(model.levels[0].network, torch.from_numpy(x))[:, 0]
    np.testing.assert_allclose(interpret.field(lower(model), points(), 1, time=0.3), expected, atol=1e-5)


def test_the_nested_field_stops_at_the_first_band_that_excludes_the_point() -> None:
    program = lower(random_model((16, 1), (16, 1), (16, 1)))
    value, reached = interpret.nested_field(program, points(), 3)
    assert set(reached) == {1, 2, 3}
    for level in (1, 2, 3):
        here = reached == level
        np.testing.assert_allclose(value[here], interpret.field(program, points()[here], level), atol=1e-5)
        if level < 3:
            assert (np.abs(value[here]) >= program.bands[level - 1].delta).all()


def test_digits_round_the_constants_and_so_the_field() -> None:
    model = random_model((16, 1), (16, 1))
    exact, coarse, fine = (lower(model, digits) for digits in (None, 2, 6))
    for name, constant in coarse.constants.items():
        np.testing.assert_array_equal(np.round(constant.astype(np.float64), 2).astype(np.float32), constant, name)
    expected = interpret.field(exact, points(), 2)
    errors = [np.abs(interpret.field(rounded, points(), 2) - expected).max() for rounded in (coarse, fine)]
    assert errors[1] < 1e-4 < errors[0] < 0.5
    gradient, _ = interpret.field_gradient(fine, points(), 2)
    np.testing.assert_allclose(gradient, interpret.field_gradient(exact, points(), 2)[0], atol=1e-3)


def test_a_small_output_row_survives_two_digits() -> None:
    model = random_model((16, 1))
    network = model.levels[0].network
    small = dataclasses.replace(network[-1], weight=network[-1].weight * np.float32(1e-4))
    level = dataclasses.replace(model.levels[0], network=(*network[:-1], small))
    tiny = Model("tiny", (level,))
    (dot,) = [op for op in lower(tiny, 2).values[0].ops if isinstance(op, Dot)]
    row = lower(tiny, 2).constants[dot.row]
    np.testing.assert_allclose(dot.scale * row, small.weight[0], atol=0.005 * dot.scale)
    assert np.count_nonzero(row) > 12


def test_the_cost_counts_multiply_adds_and_sines() -> None:
    program = lower(random_model((64, 2)))
    cost, adjoint = program.cost(program.values[0]), program.cost(program.gradients[0])
    assert cost.multiply_adds == 64 * 4 + 2 * 64 * 64 + 64
    assert cost.sines == 3 * 64
    assert adjoint.multiply_adds == 2 * (64 * 4 + 2 * 64 * 64) + 64 + 3 * 64
    assert adjoint.sines == 2 * cost.sines


def test_literals_read_back_as_the_same_float32() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate(
        [
            (rng.uniform(-1, 1, 2000) * 10.0 ** rng.integers(-12, 12, 2000)).astype(np.float32),
            np.array([0, -0.0, 1, -1, 0.5, -0.5, 100, 1e-38, 3e38, 16777216, 0.1], np.float32),
        ]
    )
    for value in values:
        text = Language().number(float(value))
        assert np.float32(text) == value, text
        assert "." in text or "e" in text, f"{text} would be an int in GLSL"
