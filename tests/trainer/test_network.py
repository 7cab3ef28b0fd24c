"""The hand-written derivatives of networks and losses against torch.autograd, and exported networks against torch."""

import numpy as np
import pytest
import torch
from torch import Tensor

from mplicits.model.model import Network
from mplicits.trainer import machine, texture
from mplicits.trainer.config import LossWeights
from mplicits.trainer.level import level_loss
from mplicits.trainer.networks import losses
from mplicits.trainer.networks.network import (
    add_derivative,
    add_derivative_along,
    adjoint_pass,
    from_model,
    initial,
    to_model,
    value,
    value_along,
    value_and_gradient,
)
from mplicits.trainer.training_samples import Pool

SIZES = [(16, 0), (16, 1), (8, 2), (24, 3)]


def network(size: tuple[int, int], outputs: int = 1, omega: float = 5.0) -> list[Tensor]:
    weights = initial(size, omega, outputs, torch.Generator().manual_seed(3))
    return [w.double().requires_grad_() for w in weights]


def points(count: int = 40) -> Tensor:
    return torch.rand(count, 3, generator=torch.Generator().manual_seed(4), dtype=torch.double) * 2 - 1


@pytest.mark.parametrize("size", SIZES)
def test_the_adjoint_gradient_matches_autograd(size: tuple[int, int]) -> None:
    weights, x = network(size), points()
    f, gradient = value_and_gradient(weights, x)
    x.requires_grad_()
    expected = value(weights, x)[:, 0]
    (slope,) = torch.autograd.grad(expected.sum(), x)
    torch.testing.assert_close(f, expected, rtol=0, atol=1e-12)
    torch.testing.assert_close(gradient, slope, rtol=0, atol=1e-12)


@pytest.mark.parametrize("size", SIZES)
def test_the_derivative_by_the_weights_matches_autograd(size: tuple[int, int]) -> None:
    weights, x = network(size), points()

    d_f, d_gradient = x[:, 0] ** 2, x.flip(1)
    for weight in weights:
        weight.grad = torch.zeros_like(weight)
    add_derivative(weights, adjoint_pass(weights, x), d_f, d_gradient)
    at = x.clone().requires_grad_()
    f = value(weights, at)[:, 0]
    (gradient,) = torch.autograd.grad(f.sum(), at, create_graph=True)
    for weight, expected in zip(weights, torch.autograd.grad((f, gradient), weights, (d_f, d_gradient)), strict=True):
        torch.testing.assert_close(weight.grad, expected, rtol=1e-10, atol=1e-12)


def test_the_derivatives_of_the_losses_match_autograd() -> None:
    gradient = (points() + 0.1).requires_grad_()
    f = points(41)[:40, 0].clone().requires_grad_()
    distance = torch.where(torch.arange(40) % 5 == 0, torch.nan, points()[:, 1])
    normals = torch.nn.functional.normalize(points().flip(0), dim=1)
    for at, (loss, slope) in (
        (f, losses.value(f, distance)),
        (f, losses.distance(f, distance, excess=20.0, lacking=5.0, near=0.008)),
        (gradient, losses.normal(gradient, normals)),
        (gradient, losses.eikonal(gradient)),
    ):
        torch.testing.assert_close(slope, torch.autograd.grad(loss, at)[0], rtol=1e-10, atol=1e-12)


def test_the_distance_loss_weights_excess_and_lack() -> None:
    truth = torch.tensor([0.2, 0.2, 0.2, 0.2, -0.2, -0.2, 0.004, torch.nan])
    f = torch.tensor([0.3, 0.15, 0.05, -0.1, -0.3, 0.1, 0.005, 9.0])
    weights = torch.tensor([20.0, 1.0, 5.0, 5.0, 20.0, 5.0, 1.0, 0.0])
    loss, _ = losses.distance(f, truth, excess=20.0, lacking=5.0, near=0.008)
    torch.testing.assert_close(loss, (weights * (f - truth.nan_to_num()).square()).mean())
    torch.testing.assert_close(losses.distance(f, truth, 1.0, 1.0, 0.0)[0], losses.value(f, truth)[0])


@pytest.mark.parametrize("length", [1.0, 4.0])
def test_the_loss_of_a_level_is_equation_4(length: float) -> None:
    f, gradient = points()[:, 0].clone().requires_grad_(), (points(40) + 0.2).requires_grad_()
    normals, distance = torch.nn.functional.normalize(points(20), dim=1), points()[:, 2]
    surface, volume = (Pool(points(20), part, normals, f, gradient) for part in (distance[:20], distance[20:]))
    weight = LossWeights(value=5, normal=3, eikonal=2, distance=7, length=length)
    loss, d_f, d_gradient, terms = level_loss(f, gradient, surface, volume, weight)
    squares = (f - distance).square()
    cosine = torch.nn.functional.cosine_similarity(gradient[:20], normals, dim=1)
    off_length = (gradient.norm(dim=1) - 1).square()
    eikonal = (length * off_length[:20].sum() + off_length[20:].sum()) / 40
    assert terms["value"] == squares[:20].mean()
    assert terms["eikonal"] == off_length.mean()
    expected = 5 * squares[:20].mean() + 7 * squares[20:].mean() + 3 * (1 - cosine).mean() + 2 * eikonal
    torch.testing.assert_close(loss, expected)
    for derivative, slope in zip((d_f, d_gradient), torch.autograd.grad(expected, (f, gradient)), strict=True):
        torch.testing.assert_close(derivative, slope)


@pytest.mark.parametrize("size", SIZES)
def test_the_directional_derivative_and_its_derivative_match_autograd(size: tuple[int, int]) -> None:
    weights, x = network(size, outputs=3), points()
    directions = points(40).flip(0)
    forward = value_along(weights, x, directions)
    expected, slope, *_ = torch.func.jvp(lambda at: value(weights, at), (x,), (directions,))
    torch.testing.assert_close(forward.value, expected, rtol=0, atol=1e-12)
    torch.testing.assert_close(forward.along, slope, rtol=0, atol=1e-12)

    d_value, d_along = x**2, x.flip(1)
    for weight in weights:
        weight.grad = torch.zeros_like(weight)
    add_derivative_along(weights, forward, d_value, d_along)
    at = x.clone().requires_grad_()
    colors = value(weights, at)
    # <grad g, direction> of each output, by a reverse pass whose graph is kept for the second derivative.
    rows = [torch.autograd.grad(colors[:, k].sum(), at, create_graph=True)[0] for k in range(3)]
    along = torch.stack([(row * directions).sum(1) for row in rows], dim=1)
    slopes = torch.autograd.grad((colors, along), weights, (d_value, d_along))
    for weight, expected_slope in zip(weights, slopes, strict=True):
        torch.testing.assert_close(weight.grad, expected_slope, rtol=1e-10, atol=1e-12)


def test_the_texture_loss_and_its_derivatives_match_autograd() -> None:
    colors, along = points().requires_grad_(), (points(40) + 0.2).requires_grad_()
    truth = points(15).abs()
    loss, d_value, d_along, terms = texture.texture_loss(colors, along, truth, 0.01)
    torch.testing.assert_close(terms["along"], along.square().sum(1).mean())
    expected = (colors[:15] - truth).square().sum(1).mean() + 0.01 * along.square().sum(1).mean()
    torch.testing.assert_close(loss, expected)
    for derivative, slope in zip((d_value, d_along), torch.autograd.grad(expected, (colors, along)), strict=True):
        torch.testing.assert_close(derivative, slope)


def forward(exported: Network, x: np.ndarray) -> np.ndarray:
    for layer in exported[:-1]:
        x = np.sin(x @ layer.weight.T + layer.bias)
    return x @ exported[-1].weight.T + exported[-1].bias


def test_an_exported_network_matches_the_torch_network() -> None:
    weights = initial((64, 2), 60.0, 1, torch.Generator().manual_seed(0))
    x = points(1000).float()
    assert np.abs(forward(to_model(weights), x.numpy()) - value(weights, x).numpy()).max() < 1e-5
    for read, written in zip(from_model(to_model(weights)), weights, strict=True):
        assert torch.equal(read, written)


def test_a_residual_starts_near_zero() -> None:
    first, residual = (initial((64, 2), 60.0, 1, torch.Generator().manual_seed(0), last) for last in (1.0, 0.1))
    x = points(1000).float()
    assert float(value(residual, x).abs().max()) < 0.11 * float(value(first, x).abs().max())


def test_matrix_products_keep_the_precision_of_float32(monkeypatch: pytest.MonkeyPatch) -> None:
    before, threads = torch.get_float32_matmul_precision(), torch.get_num_threads()
    try:
        machine.prepare(torch.device("cpu"))
        assert machine.products_are_exact()
        monkeypatch.setattr(machine, "products_are_exact", lambda: False)
        machine.prepare(torch.device("cpu"))
        assert torch.get_float32_matmul_precision() == "highest"
    finally:
        torch.set_float32_matmul_precision(before)
        torch.set_num_threads(threads)
