"""NeuS's volume rendering and the field's backward pass against closed forms and autograd."""

import math

import pytest
import torch

from mplicits.capture.learner import SHARP, Learner
from mplicits.capture.multiscale import MultiscaleField
from mplicits.capture.rays import RayBatches, Rays
from mplicits.capture.rendering import Effort, Factors, loss_of, render
from mplicits.capture.scene import MultiscaleScene
from mplicits.capture.volume import opacities, sample, sections, weights_of
from mplicits.trainer.networks.network import initial, value

RADIUS = 0.5


def rays_at(heights: list[float], inside: list[float] | None = None) -> Rays:
    """Return rays along z through the unit ball at heights y."""
    y = torch.tensor(heights)
    eyes = torch.stack([torch.zeros_like(y), y, torch.full_like(y, -3.0)], dim=1)
    directions = torch.tensor([[0.0, 0.0, 1.0]]).expand(len(y), 3)
    half = torch.sqrt(1 - y**2)
    masks = None if inside is None else torch.tensor(inside)
    return Rays(eyes, directions, 3 - half, 3 + half, torch.full((len(y), 3), 0.5), masks)


def ball(points: torch.Tensor) -> torch.Tensor:
    distance: torch.Tensor = torch.linalg.vector_norm(points, dim=1) - RADIUS
    return distance


def test_samples_concentrate_at_the_surface() -> None:
    rays = rays_at([0.0, 0.3, 0.45])
    depths = sample(rays, ball, (16, 24), 2, 128.0, torch.Generator().manual_seed(0))
    assert depths.shape == (3, 40)
    assert (depths.diff(dim=1) >= 0).all()
    assert (depths >= rays.near[:, None]).all()
    assert (depths <= rays.far[:, None] + 1e-5).all()
    entry = 3 - torch.sqrt(RADIUS**2 - rays.eyes[:, 1] ** 2)
    assert (((depths - entry[:, None]).abs() < 0.1).sum(dim=1) > 12).all()


def test_weights_peak_where_the_ray_enters() -> None:
    """NeuS, section 3.1: the maximum is at the surface, and the first surface occludes the second."""
    rays = rays_at([0.0, 0.2, 0.9])
    depths = torch.linspace(0, 1, 801)[:-1] * (rays.far - rays.near)[:, None] + rays.near[:, None]
    centers, lengths = sections(rays, depths)
    points = centers.reshape(-1, 3)
    gradient = torch.nn.functional.normalize(points, dim=1)
    alpha = opacities(
        ball(points).reshape(depths.shape),
        gradient.reshape(*depths.shape, 3),
        rays.directions,
        lengths,
        torch.tensor(300.0),
        1.0,
    )
    weights = weights_of(alpha)
    torch.testing.assert_close(weights.sum(dim=1), torch.tensor([1.0, 1.0, 0.0]), atol=0.02, rtol=0)
    middles = depths + lengths / 2
    for row, y in enumerate((0.0, 0.2)):
        assert float(middles[row, weights[row].argmax()]) == pytest.approx(3 - math.sqrt(RADIUS**2 - y**2), abs=0.005)
    assert float(weights[0, middles[0] > 3.0].sum()) < 1e-3


def tiny_levels() -> list[list[torch.Tensor]]:
    generator = torch.Generator().manual_seed(3)
    return [[w.double() for w in initial(size, 6.0, 1, generator)] for size in ((8, 1), (12, 2))]


def test_the_backward_pass_matches_autograd() -> None:
    levels, delta = tiny_levels(), 0.1
    for weights in levels:
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
    points = torch.rand(200, 3, generator=torch.Generator().manual_seed(1)).double() * 2 - 1
    field = MultiscaleField(levels, [delta])
    found = field.evaluate(points)
    assert 0 < len(found.passes[1][1]) < len(points)

    assert found.features.shape == (200, 8 + 12)

    def loss_on(f: torch.Tensor, gradient: torch.Tensor, features: torch.Tensor) -> torch.Tensor:
        loss: torch.Tensor = (torch.sigmoid(3 * f) * gradient[:, 0]).sum() + (gradient.norm(dim=1) - 1).square().sum()
        return loss + (features @ torch.linspace(-1, 2, 20).double()).square().sum()

    loss_on(found.f, found.gradient, found.features).backward()  # type: ignore[no-untyped-call]
    field.backward(found)
    copies = [[w.detach().clone().requires_grad_() for w in weights] for weights in levels]
    at = points.clone().requires_grad_()
    f, hidden = value_of(copies[0], at)
    inside = f.detach().abs() < delta
    residual, finer = value_of(copies[1], at)
    f, features = f + inside * residual, torch.cat((hidden, inside[:, None] * finer), dim=1)
    gradient = torch.autograd.grad(f.sum(), at, create_graph=True)[0]
    torch.testing.assert_close(found.f.detach(), f.detach())
    torch.testing.assert_close(found.gradient.detach(), gradient.detach())
    torch.testing.assert_close(found.features.detach(), features.detach())
    torch.testing.assert_close(field.features(points), features.detach())
    loss_on(f, gradient, features).backward()  # type: ignore[no-untyped-call]
    for weights, theirs in zip(levels, copies, strict=True):
        for weight, other in zip(weights, theirs, strict=True):
            torch.testing.assert_close(weight.grad, other.grad)


def value_of(weights: list[torch.Tensor], points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Evaluate a SIREN and its last hidden layer in twice differentiable operations."""
    hidden = points
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        hidden = torch.sin(hidden @ weight.t() + bias)
    result: torch.Tensor = (hidden @ weights[-2].t() + weights[-1])[:, 0]
    torch.testing.assert_close(result.detach(), value([w.detach() for w in weights], points.detach())[:, 0])
    return result, hidden


def test_masks_and_background_change_the_loss() -> None:
    scene = MultiscaleScene(((8, 1),), (8.0,), (), 8, torch.device("cpu"), 0)
    scene.become_sphere(0)
    rays = rays_at([0.0, 0.9])
    rendered = render(scene, rays, Effort())
    on, off = rendered.opacity.tolist()
    assert on > 0.9
    assert off < 0.5
    right, wrong = (
        float(loss_of(rendered, rays_at([0.0, 0.9], inside), Factors(eikonal=0), 0.0).detach())
        for inside in ([1.0, 0.0], [0.0, 1.0])
    )
    assert right < wrong
    black, white = (float(loss_of(rendered, rays, Factors(), gray).detach()) for gray in (0.0, 1.0))
    assert black != white


def test_half_of_the_rays_hit_the_object_with_corrected_weights() -> None:
    rays = rays_at([0.01 * k for k in range(60)], [1.0] * 6 + [0.0] * 54)
    batches = RayBatches(rays, 4000, torch.Generator().manual_seed(0))
    inside = next(batches).inside
    assert inside is not None
    count = float(inside.sum())
    assert count == pytest.approx(0.55 * 4000, rel=0.05)
    assert batches.inside * count / 6 == pytest.approx((4000 - count) / 54, rel=0.1)


def test_masks_raise_the_lower_bound_of_the_sharpness() -> None:
    for inside, least in (([1.0, 0.0], SHARP), (None, 0.0)):
        scene = MultiscaleScene(((8, 1),), (8.0,), (), 8, torch.device("cpu"), 0)
        scene.become_sphere(0)
        learner = Learner(scene, rays_at([0.0, 0.9], inside), 16, 0.0, 0)
        learner.step(0.0)
        assert float(scene.sharpness().detach()) < 30
        learner.step(0.9)
        assert float(scene.sharpness().detach()) >= least
        assert scene.least_sharpness == pytest.approx(least)
