"""The paper's Algorithm 1 (Appendix E): value and gradient of a network by one forward pass with three tangents.

Table 9 measures it against `network.value_and_gradient`, which needs two matrix products per layer in place of four.
"""

import torch
from torch import Tensor

from mplicits.trainer.networks.network import Weights, cos, sin_


@torch.no_grad()
def value_and_gradient(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate value (N,) and gradient (N, 3) of a network with one output at points (N, 3).

    The three tangents share the values, which the paper's listing recomputes for each coordinate.
    """
    angle = torch.addmm(weights[1], points, weights[0].t())
    cosine = cos(angle)
    hidden = sin_(angle)
    tangents = [cosine * column for column in weights[0].t()]
    for weight, bias in zip(weights[2:-2:2], weights[3:-2:2], strict=True):
        angle = torch.addmm(bias, hidden, weight.t())
        cosine = cos(angle)
        hidden = sin_(angle)
        tangents = [(tangent @ weight.t()).mul_(cosine) for tangent in tangents]
    row = weights[-2][0]
    return torch.addmv(weights[-1], hidden, row), torch.stack([tangent @ row for tangent in tangents], dim=1)
