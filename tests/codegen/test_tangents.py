"""The paper's Algorithm 1, in the reference and in torch, against the adjoint pass and autograd."""

import dataclasses

import numpy as np
import pytest
import torch
from mplicits.codegen.ir.lower import lower
from mplicits.codegen.ir.program import Affine, Program, Transposed
from mplicits.codegen.reference import interpret
from mplicits.codegen.reference.tangents import with_tangents
from mplicits.model.model import Model
from mplicits.trainer.networks import network, tangents

from support.random_model import random_model

SHAPES = [(16, 0), (10, 1), (33, 2), (64, 3)]


def points(count: int = 500) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (count, 3)).astype(np.float32)


def by_program(program: Program, level: int, fourth: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    extended, function = with_tangents(program, level)
    extended.widths(function)
    inputs = np.concatenate([points(), np.full((500, 1), fourth, np.float32)], axis=1)
    x, y, z, f = interpret.run(extended, function, inputs)
    return f[:, 0], np.concatenate([x, y, z], axis=1)


def by_autograd(model: Model, level: int) -> tuple[np.ndarray, np.ndarray]:
    weights = network.from_model(model.levels[level - 1].network)
    x = torch.from_numpy(points()).requires_grad_()
    f = network.value(weights, x)[:, 0]
    return f.detach().numpy(), torch.autograd.grad(f.sum(), x)[0].numpy()


def close(found: np.ndarray, expected: np.ndarray) -> bool:
    return bool(np.abs(found - expected).max() < 1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("shape", SHAPES)
def test_algorithm_1_is_the_adjoint_is_autograd(shape: tuple[int, int]) -> None:
    model = random_model(shape)
    weights, x = network.from_model(model.levels[0].network), torch.from_numpy(points())
    program = lower(model)
    gradient, f = interpret.field_gradient(program, points(), 1)
    expected = by_autograd(model, 1)
    in_torch = [
        (f.numpy(), gradient.numpy())
        for f, gradient in (tangents.value_and_gradient(weights, x), network.value_and_gradient(weights, x))
    ]
    for found in (by_program(program, 1), (f, gradient), *in_torch):
        assert close(found[0], expected[0])
        assert close(found[1], expected[1])


def test_level_is_the_one_asked_for() -> None:
    model = random_model((8, 1), (12, 2))
    for level in (1, 2):
        assert close(by_program(lower(model), level)[1], by_autograd(model, level)[1])


def test_time_has_no_tangent() -> None:
    program = lower(random_model((16, 1), inputs="xyzt"))
    gradient, f = interpret.field_gradient(program, points(), 1, time=0.3)
    found = by_program(program, 1, 0.3)
    assert close(found[0], f)
    assert close(found[1], gradient)


def test_rounded_output_rows_keep_their_scale() -> None:
    program = lower(random_model((16, 1)), digits=2)
    assert close(by_program(program, 1)[1], interpret.field_gradient(program, points(), 1)[0])


def test_algorithm_1_takes_twice_the_products_of_the_adjoint() -> None:
    program = lower(random_model((64, 3)))
    extended, function = with_tangents(program, 1)
    hidden = [size for size in (op.matrix for op in function.ops if isinstance(op, Affine)) if size != "w1_0"]
    adjoint = [op.matrix for op in program.gradients[0].ops if isinstance(op, Affine | Transposed)]
    assert len(hidden) == 4 * 3
    assert len([matrix for matrix in adjoint if matrix != "w1_0"]) == 2 * 3
    assert extended.cost(function).sines == program.cost(program.gradients[0]).sines


def test_an_op_without_tangent_is_refused() -> None:
    program = lower(random_model((8, 1)))
    with pytest.raises(TypeError, match="no part"):
        with_tangents(dataclasses.replace(program, values=program.gradients), 1)
