"""The radiance network: the color of a point seen from a direction."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn

POINT_FREQUENCIES, DIRECTION_FREQUENCIES = 6, 4  # octaves of the positional encodings (NeRF, Mildenhall et al. 2020).
LAYERS = 4  # number of hidden layers


def encode(x: Tensor, frequencies: int) -> Tensor:
    """Append sin(2^k x) and cos(2^k x) for k below `frequencies`. x: (N, 3). Returns (N, 3 + 6 frequencies)."""
    return torch.cat([x, *(wave(2.0**k * x) for k in range(frequencies) for wave in (torch.sin, torch.cos))], dim=1)


class Radiance(nn.Module):
    """Maps a point, a view direction, a normal and features to a color."""

    def __init__(self, width: int, features: int, generator: torch.Generator) -> None:
        """width: of the hidden layers. features: number of features of a point. generator: draws the weights."""
        super().__init__()
        self.width = width
        inputs = 3 * (1 + 2 * POINT_FREQUENCIES) + 3 * (1 + 2 * DIRECTION_FREQUENCIES) + 3 + features
        layers: list[nn.Module] = []
        for fan_in, fan_out in pairwise([inputs, *[width] * LAYERS, 3]):
            layer = nn.Linear(fan_in, fan_out)
            bound = math.sqrt(6 / fan_in) if fan_out > 3 else 1 / math.sqrt(fan_in)
            with torch.no_grad():
                layer.weight.copy_((2 * torch.rand(fan_out, fan_in, generator=generator) - 1) * bound)
                layer.bias.zero_()
            layers += [layer, nn.ReLU()]
        self._network = nn.Sequential(*layers[:-1])

    def forward(self, points: Tensor, directions: Tensor, gradient: Tensor, features: Tensor) -> Tensor:
        """Evaluate the color (N, 3), sRGB in [0, 1].

        points, directions, gradient (the normals): (N, 3) each. features: (N, F), of the field's networks.
        """
        encoded = encode(points, POINT_FREQUENCIES), encode(directions, DIRECTION_FREQUENCIES)
        color: Tensor = torch.sigmoid(self._network(torch.cat((*encoded, gradient, features), dim=1)))
        return color
