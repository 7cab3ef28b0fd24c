"""The scene that `photos` learns: a multiscale signed distance, a radiance network, and the surface's sharpness."""

from dataclasses import dataclass

import torch
from torch import Tensor

from ..trainer import level
from ..trainer.networks import losses
from ..trainer.networks.network import Weights, add_derivative, adjoint_pass
from ..trainer.networks.optimiser import Optimiser
from .multiscale import Evaluated, MultiscaleField
from .radiance import Radiance
from .rendering import Shade

SPHERE = 0.5
"""Radius of the sphere that a field begins as."""
SPHERE_STEPS, SPHERE_POINTS, SPHERE_RATE = 300, 1024, 5e-3
"""Steps in which it becomes that sphere, samples of each, and the peak rate."""
SPHERE_EIKONAL = 0.02
SHARPNESS = 0.3
"""Logarithm of s at the beginning, over `SHARPNESS_UNIT` (NeuS)."""
SHARPNESS_UNIT = 10.0


@dataclass(frozen=True)
class Sizes:
    """The sizes of the networks."""

    levels: tuple[tuple[int, int], ...]
    """(width, depth) of each level, coarse to fine."""
    omegas: tuple[float, ...]
    """omega_0 of each level."""
    deltas: tuple[float, ...]
    """Half widths of the bands of all levels but the last, model units."""
    radiance: int
    """Width of the radiance network."""


class MultiscaleScene:
    """A `Scene` whose distance is a sum of nested levels."""

    def __init__(self, sizes: Sizes, device: torch.device, seed: int) -> None:
        """Begin with a sphere, residuals near zero, and a radiance network of random weights."""
        self.levels = []
        for i, (size, omega) in enumerate(zip(sizes.levels, sizes.omegas, strict=True)):
            self.levels.append(level.start(size, omega, first=i == 0, seed=seed + i, device=device)())
        self.field = MultiscaleField(self.levels, sizes.deltas)
        self.radiance = Radiance(sizes.radiance, sum(self.field.widths), torch.Generator().manual_seed(seed)).to(device)
        self.logarithm = torch.tensor(SHARPNESS, device=device, requires_grad=True)
        self.least_sharpness = 0.0
        """s is at least this."""
        self._evaluated: Evaluated | None = None

    def become_sphere(self, seed: int) -> None:
        """Fit level 1 to the signed distance of a sphere."""
        weights = self.levels[0]
        generator = torch.Generator().manual_seed(seed)
        optimiser = Optimiser(weights, SPHERE_RATE, level.OUTPUT_FACTOR)
        for step in range(SPHERE_STEPS):
            points = (2 * torch.rand(SPHERE_POINTS, 3, generator=generator) - 1).to(weights[0].device)
            forward = adjoint_pass(weights, points)
            _, d_f = losses.value(forward.f, torch.linalg.vector_norm(points, dim=1) - SPHERE)
            _, d_gradient = losses.eikonal(forward.gradient)
            add_derivative(weights, forward, d_f, SPHERE_EIKONAL * d_gradient)
            optimiser.step(1 - step / SPHERE_STEPS)

    def guide(self, points: Tensor) -> Tensor:
        """Evaluate level 1 alone, (N,)."""
        return self.field.values(points, 1)

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate the levels in use; their graph ends at the values and gradients (see multiscale.py)."""
        evaluated = self._evaluated = self.field.evaluate(points)

        def shade(index: Tensor, directions: Tensor, gradient: Tensor) -> Tensor:
            colours: Tensor = self.radiance(points[index], directions, gradient, evaluated.features[index])
            return colours

        return evaluated.f, evaluated.gradient, shade

    def sharpness(self) -> Tensor:
        """Return s."""
        return torch.exp(SHARPNESS_UNIT * self.logarithm).clamp_min(self.least_sharpness)

    def backward(self, loss: Tensor) -> None:
        """Differentiate as far as the field's values by autograd, and from there by hand."""
        loss.backward()  # type: ignore[no-untyped-call]
        assert self._evaluated is not None
        self.field.backward(self._evaluated)
        self._evaluated = None

    def optimisers(self, rate: float, radiance: float, sharpness: float) -> list[tuple[list[Tensor], Optimiser]]:
        """Make an optimiser for each network, and for log s, and return each with its parameters.

        rate, radiance: peak rates of the levels' and of the radiance's hidden layers up to 64 wide; those of wider ones
        are lower. sharpness: of log s.
        """
        made: list[tuple[list[Tensor], Optimiser]] = []
        for i, weights in enumerate(self.levels):
            relative, factor = level.rates(len(weights[0]), self.field.deltas[i - 1] if i else None)
            made.append((weights, Optimiser(weights, rate * relative / level.RATE, factor)))
        parameters: list[Tensor] = list(self.radiance.parameters())
        slower = min(1, level.RATE_WIDTH / self.radiance.width)
        made.append((parameters, Optimiser(parameters, radiance * slower, 1.0)))
        return [*made, ([self.logarithm], Optimiser([self.logarithm], sharpness, 1.0))]

    def weights(self) -> list[Weights]:
        """Return the levels in use, as weights that share nothing with the training."""
        return [[w.detach().clone() for w in weights] for weights in self.levels[: self.field.active]]
