"""Quantisation in every training step, so that training itself makes up for the rounding of the weights.

model/quantise.py defines which multiples of a step the weights of a layer may be.
"""

import torch

from ...model import quantise
from .fit import Step
from .network import Weights, from_model, to_model


@torch.no_grad()
def quantised(weights: Weights) -> Weights:
    """Return the nearest weights that are multiples of their steps.

    They share their .grad with `weights`: a gradient passes through the rounding as if it were not there.
    """
    rounded = [w.to(weights[0].device) for w in from_model(quantise.quantised(to_model(weights)))]
    for near, weight in zip(rounded, weights, strict=True):
        near.grad = weight.grad
    return rounded


def quantised_step(step: Step) -> Step:
    """Make a step that is taken at the quantised weights.

    It also clamps the matrices of hidden layers to the largest multiples, so that no weight runs away beyond them.
    """

    @torch.no_grad()
    def run(weights: Weights) -> float:
        rounded = quantised(weights)
        for near, weight in zip(rounded[2:-2:2], weights[2:-2:2], strict=True):
            largest = float(near.abs().max())
            weight.clamp_(-largest, largest)
        return step(rounded)

    return run
