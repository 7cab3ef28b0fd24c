"""The paper's Algorithm 1, in the program's ops, agrees with the adjoint pass and autograd."""

import dataclasses

import numpy as np
import pytest
import torch

from mplicits.field import interpret
from mplicits.field.run import run
from mplicits.ir.lower import lower
from mplicits.ir.program import Affine, Program, Transposed
from mplicits.model.model import Model
from mplicits.trainer.networks import network
from oracles.tangents import with_tangents
from oracles.well_formed import check_function
from support.random_model import random_model

SHAPES = [(16, 0), (10, 1), (33, 2), (64, 3)]


def points(count: int = 500) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (count, 3)).astype(np.float32)


def by_algorithm_1(program: Program, level: int, fourth: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return a level's network at points(), (N,), and its gradient, (N, 3). fourth: fourth component of the input."""
    extended, function = with_tangents(program, level)
    check_function(extended, function, [1, 1, 1, 1])
    inputs = np.concatenate([points(), np.full((500, 1), fourth, np.float32)], axis=1)
    x, y, z, f = run(extended, function, inputs)
    return f[:, 0], np.concatenate([x, y, z], axis=1)


def by_autograd(model: Model, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a level's network at points(), (N,), and its gradient, (N, 3), by torch."""
    weights = network.from_model(model.levels[level - 1].network)
    x = torch.from_numpy(points()).requires_grad_()
    f = network.value(weights, x)[:, 0]
    return f.detach().numpy(), torch.autograd.grad(f.sum(), x)[0].numpy()


def close(values: np.ndarray, expected: np.ndarray) -> bool:
    """Whether arrays differ by less than 1e-5 of the largest expected number."""
    return bool(np.abs(values - expected).max() < 1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("shape", SHAPES)
def test_algorithm_1_the_adjoint_and_autograd_agree(shape: tuple[int, int]) -> None:
    model = random_model(shape)
    weights, x = network.from_model(model.levels[0].network), torch.from_numpy(points())
    program = lower(model)
    gradient, f = interpret.field_gradient(program, points(), 1)
    expected = by_autograd(model, 1)
    in_torch = tuple(tensor.numpy() for tensor in network.value_and_gradient(weights, x))
    for value, slope in (by_algorithm_1(program, 1), (f, gradient), in_torch):
        assert close(value, expected[0])
        assert close(slope, expected[1])


def test_each_level_s_own_network_is_differentiated() -> None:
    model = random_model((8, 1), (12, 2))
    for level in (1, 2):
        assert close(by_algorithm_1(lower(model), level)[1], by_autograd(model, level)[1])


def test_time_has_no_tangent() -> None:
    program = lower(random_model((16, 1), inputs="xyzt"))
    gradient, f = interpret.field_gradient(program, points(), 1, time=0.3)
    value, tangents_of_space = by_algorithm_1(program, 1, 0.3)
    assert close(value, f)
    assert close(tangents_of_space, gradient)


def test_rounded_output_rows_keep_their_scale() -> None:
    program = lower(random_model((16, 1)), digits=2)
    assert close(by_algorithm_1(program, 1)[1], interpret.field_gradient(program, points(), 1)[0])


def test_algorithm_1_takes_twice_the_products_of_the_adjoint() -> None:
    program = lower(random_model((64, 3)))
    extended, function = with_tangents(program, 1)
    hidden = [op.matrix for op in function.ops if isinstance(op, Affine) and op.matrix != "w1_0"]
    adjoint = [op.matrix for op in program.gradients[0].ops if isinstance(op, Affine | Transposed)]
    assert len(hidden) == 4 * 3
    assert len([matrix for matrix in adjoint if matrix != "w1_0"]) == 2 * 3
    assert extended.cost(function).sines == program.cost(program.gradients[0]).sines


def test_an_op_without_tangent_is_refused() -> None:
    program = lower(random_model((8, 1)))
    with pytest.raises(TypeError, match="no part"):
        with_tangents(dataclasses.replace(program, values=program.gradients), 1)
