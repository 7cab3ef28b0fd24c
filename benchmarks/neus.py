"""NeuS's own scene (Wang et al. 2021), to compare ours with: one ReLU-like network, differentiated twice by autograd.

The distance: hidden layers of softplus(100 x), positional encoding of 6 octaves, a skip connection, the geometric
initialization of SAL/IDR, weight normalization, and a feature vector that the radiance network takes. Both networks are
evaluated at every sample, as far as `render` asks; the rest of the pipeline is ours and the same for both.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn.functional import softplus
from torch.nn.utils.parametrizations import weight_norm

from mplicits.capture.radiance import encode
from mplicits.capture.rendering import Shade

OCTAVES, DIRECTION_OCTAVES = 6, 4
BIAS = 0.5
"""Radius of the sphere that the distance begins as."""
STEEP = 100.0
"""beta of softplus."""
SHARPNESS, UNIT = 0.3, 10.0
"""s begins as exp(UNIT * SHARPNESS)."""


class Distance(nn.Module):
    """NeuS's SDFNetwork: points (N, 3) become the distance and a feature vector (N, 1 + width)."""

    def __init__(self, width: int, layers: int, skip: int) -> None:
        """layers: hidden ones. skip: the layer that takes the encoded point once more."""
        super().__init__()
        encoded = 3 + 6 * OCTAVES
        sizes = [encoded, *[width] * layers, 1 + width]
        self._skip, self._layers = skip, nn.ModuleList()
        for k, (before, after) in enumerate(pairwise(sizes)):
            layer = nn.Linear(before, after - encoded if k + 1 == skip else after)
            with torch.no_grad():
                self._geometric(layer, k, len(sizes) - 2, encoded)
            self._layers.append(weight_norm(layer))

    def _geometric(self, layer: nn.Linear, k: int, last: int, encoded: int) -> None:
        """Initialize so that the network begins as the distance of a sphere (Atzmon and Lipman 2020)."""
        if k == last:
            nn.init.normal_(layer.weight, math.sqrt(math.pi) / math.sqrt(layer.in_features), 1e-4)
            nn.init.constant_(layer.bias, -BIAS)
            return
        nn.init.constant_(layer.bias, 0.0)
        nn.init.normal_(layer.weight, 0.0, math.sqrt(2) / math.sqrt(layer.out_features))
        if k == 0:
            nn.init.constant_(layer.weight[:, 3:], 0.0)
        elif k == self._skip:
            nn.init.constant_(layer.weight[:, -(encoded - 3) :], 0.0)

    def forward(self, points: Tensor) -> Tensor:
        """Evaluate the network."""
        encoded = hidden = encode(points, OCTAVES)
        for k, layer in enumerate(self._layers):
            if k == self._skip:
                hidden = torch.cat((hidden, encoded), dim=1) / math.sqrt(2)
            hidden = layer(hidden)
            if k + 1 < len(self._layers):
                hidden = softplus(hidden, beta=STEEP)
        return hidden


class NeusScene:
    """A `Scene` as NeuS publishes it, at any width."""

    def __init__(
        self,
        width: int,
        layers: int,
        skip: int,
        radiance: int,
        seed: int,
        device: str | torch.device = "cpu",
    ) -> None:
        """width, layers, skip: of `Distance`; NeuS has 256, 8 and 4. radiance: width of four hidden layers."""
        torch.manual_seed(seed)
        self.distance = Distance(width, layers, skip).to(device)
        sizes = [3 + 3 + 6 * DIRECTION_OCTAVES + 3 + width, *[radiance] * 4, 3]
        parts: list[nn.Module] = []
        for before, after in pairwise(sizes):
            parts += [weight_norm(nn.Linear(before, after)), nn.ReLU()]
        self._radiance = nn.Sequential(*parts[:-1]).to(device)
        self.logarithm = torch.tensor(SHARPNESS, device=device, requires_grad=True)

    def guide(self, points: Tensor) -> Tensor:
        """Evaluate the distance (N,), without a graph."""
        with torch.no_grad():
            values: Tensor = self.distance(points)
        return values[:, 0]

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate the distance with a graph of its gradient, which a loss is differentiated through."""
        wanted = torch.is_grad_enabled()
        with torch.enable_grad():
            points = points.requires_grad_()
            values = self.distance(points)
            gradient = torch.autograd.grad(values[:, 0].sum(), points, create_graph=wanted)[0]

        def shade(index: Tensor, directions: Tensor, slope: Tensor) -> Tensor:
            inputs = points[index], encode(directions, DIRECTION_OCTAVES), slope, values[index, 1:]
            return torch.sigmoid(self._radiance(torch.cat(inputs, dim=1)))

        return values[:, 0], gradient, shade

    def sharpness(self) -> Tensor:
        """Return s."""
        return torch.exp(UNIT * self.logarithm)

    def backward(self, loss: Tensor) -> None:
        """Differentiate twice."""
        loss.backward()  # type: ignore[no-untyped-call]

    def parameters(self) -> Sequence[Tensor]:
        """List all parameters."""
        return [*self.distance.parameters(), *self._radiance.parameters(), self.logarithm]

    def size(self) -> int:
        """Count the parameters of the distance."""
        return sum(parameter.numel() for parameter in self.distance.parameters())
