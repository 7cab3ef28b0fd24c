"""The scene of `photos`: a multiscale signed distance, a radiance network, and the sharpness of the surface."""

from collections.abc import Sequence

import torch
from torch import Tensor

from ..trainer import level
from ..trainer.config import StepConfig
from ..trainer.networks import losses
from ..trainer.networks.network import Weights, add_derivative, adjoint_pass
from ..trainer.networks.optimizer import Optimizer
from .multiscale import Evaluated, MultiscaleField
from .radiance import Radiance
from .rendering import Shade

STEP = StepConfig()
SPHERE = 0.5  # radius of the initial sphere
SPHERE_STEPS, SPHERE_POINTS, SPHERE_RATE = 300, 1024, 5e-3
"""Steps, samples per step and peak rate of the fit to the sphere."""
SPHERE_EIKONAL = 0.02
SHARPNESS, SHARPNESS_UNIT = 0.3, 10.0  # initial logarithm of s, divided by SHARPNESS_UNIT (NeuS)


class MultiscaleScene:
    """A `Scene` of nested levels."""

    def __init__(
        self,
        sizes: Sequence[tuple[int, int]],
        omegas: Sequence[float],
        deltas: Sequence[float],
        radiance: int,
        device: torch.device,
        seed: int,
    ) -> None:
        """Initialize the networks, residuals near zero.

        sizes, omegas: (width, depth) and omega_0 of each level, coarse to fine. deltas: band half-widths of all levels
        but the last, model units. radiance: width of the radiance network.
        """
        self.levels = []
        for i, (size, omega) in enumerate(zip(sizes, omegas, strict=True)):
            first, own_seed = i == 0, seed + i
            self.levels.append(level.initial_level(size, omega, first=first, seed=own_seed, device=device, config=STEP))
        self.field = MultiscaleField(self.levels, deltas)
        self.radiance = Radiance(radiance, sum(self.field.widths), torch.Generator().manual_seed(seed)).to(device)
        self.logarithm = torch.tensor(SHARPNESS, device=device, requires_grad=True)
        self.least_sharpness = 0.0
        """Lower bound of s."""
        self._evaluated: Evaluated | None = None

    def become_sphere(self, seed: int) -> None:
        """Fit level 1 to the signed distance of a sphere."""
        weights = self.levels[0]
        generator = torch.Generator().manual_seed(seed)
        optimizer = Optimizer(weights, SPHERE_RATE, STEP.output_factor)
        for step in range(SPHERE_STEPS):
            points = (2 * torch.rand(SPHERE_POINTS, 3, generator=generator) - 1).to(weights[0].device)
            forward = adjoint_pass(weights, points)
            _, d_f = losses.value(forward.f, torch.linalg.vector_norm(points, dim=1) - SPHERE)
            _, d_gradient = losses.eikonal(forward.gradient)
            add_derivative(weights, forward, d_f, SPHERE_EIKONAL * d_gradient)
            optimizer.step(1 - step / SPHERE_STEPS)

    def guide(self, points: Tensor) -> Tensor:
        """Evaluate level 1 only, (N,)."""
        return self.field.values(points, 1)

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate the levels in use; the graph ends at the values and gradients (multiscale.py)."""
        evaluated = self._evaluated = self.field.evaluate(points)

        def shade(index: Tensor, directions: Tensor, gradient: Tensor) -> Tensor:
            colors: Tensor = self.radiance(points[index], directions, gradient, evaluated.features[index])
            return colors

        return evaluated.f, evaluated.gradient, shade

    def sharpness(self) -> Tensor:
        """Return s."""
        return torch.exp(SHARPNESS_UNIT * self.logarithm).clamp_min(self.least_sharpness)

    def backward(self, loss: Tensor) -> None:
        """Differentiate by autograd to the field's values, and from there by hand."""
        loss.backward()  # type: ignore[no-untyped-call]
        assert self._evaluated is not None
        self.field.backward(self._evaluated)
        self._evaluated = None

    def optimizers(self, rate: float, radiance: float, sharpness: float) -> list[tuple[list[Tensor], Optimizer]]:
        """Create an optimizer for each network and for log s. Returns each with its parameters.

        rate, radiance: peak rates of the levels and of the radiance network, for layers up to 64 wide; wider layers
        have lower rates. sharpness: rate of log s.
        """
        pairs: list[tuple[list[Tensor], Optimizer]] = []
        for i, weights in enumerate(self.levels):
            relative, factor = level.rates(len(weights[0]), self.field.deltas[i - 1] if i else None, STEP)
            pairs.append((weights, Optimizer(weights, rate * relative / STEP.rate, factor)))
        parameters: list[Tensor] = list(self.radiance.parameters())
        slower = min(1, STEP.rate_width / self.radiance.width)
        pairs.append((parameters, Optimizer(parameters, radiance * slower, 1.0)))
        return [*pairs, ([self.logarithm], Optimizer([self.logarithm], sharpness, 1.0))]

    def weights(self) -> list[Weights]:
        """Return copies of the levels in use."""
        return [[w.detach().clone() for w in weights] for weights in self.levels[: self.field.active]]
