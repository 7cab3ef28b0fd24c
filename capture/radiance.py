"""The radiance network: the colour that a point sends in a direction."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn

POINT_FREQUENCIES, DIRECTION_FREQUENCIES = 6, 4
"""Octaves of the positional encodings (NeRF, Mildenhall et al. 2020)."""
LAYERS = 4
"""Hidden layers."""


def encode(x: Tensor, frequencies: int) -> Tensor:
    """Append sin(2^k x) and cos(2^k x) for k below `frequencies`. x: (N, 3). Returns (N, 3 + 6 frequencies)."""
    return torch.cat([x, *(wave(2.0**k * x) for k in range(frequencies) for wave in (torch.sin, torch.cos))], dim=1)


class Radiance(nn.Module):
    """A point, the direction of sight and the normal become a colour."""

    def __init__(self, width: int, features: int, generator: torch.Generator) -> None:
        """width: of the hidden layers. features: of a point. generator: draws the weights."""
        super().__init__()
        self.width = width
        inputs = 3 * (1 + 2 * POINT_FREQUENCIES) + 3 * (1 + 2 * DIRECTION_FREQUENCIES) + 3 + features
        sizes = [inputs, *[width] * LAYERS, 3]
        layers: list[nn.Module] = []
        for before, after in pairwise(sizes):
            layer = nn.Linear(before, after)
            bound = math.sqrt(6 / before) if after > 3 else 1 / math.sqrt(before)
            with torch.no_grad():
                layer.weight.copy_((2 * torch.rand(after, before, generator=generator) - 1) * bound)
                layer.bias.zero_()
            layers += [layer, nn.ReLU()]
        self._network = nn.Sequential(*layers[:-1])

    def forward(self, points: Tensor, directions: Tensor, gradient: Tensor, features: Tensor) -> Tensor:
        """Evaluate the colour, sRGB in [0, 1], (N, 3).

        points, directions of sight, and gradients of the field, which are the normals: (N, 3) each. features: (N, F),
        what the field's networks know of the points.
        """
        encoded = encode(points, POINT_FREQUENCIES), encode(directions, DIRECTION_FREQUENCIES)
        colour: Tensor = torch.sigmoid(self._network(torch.cat((*encoded, gradient, features), dim=1)))
        return colour
