"""Keeps weights on the grids of model/quantise.py in every step, so that training makes up for the rounding."""

import torch

from ...model import quantise
from .fit import Step
from .network import Weights, from_model, to_model


@torch.no_grad()
def rounded(weights: Weights) -> Weights:
    """The nearest weights on grids. Their .grad is that of `weights`: a gradient passes through the rounding."""
    found = [w.to(weights[0].device) for w in from_model(quantise.rounded(to_model(weights)))]
    for near, weight in zip(found, weights, strict=True):
        near.grad = weight.grad
    return found


def rounding(step: Step) -> Step:
    """The step, taken at the rounded weights; weights of hidden layers do not run away beyond their grid's end."""

    @torch.no_grad()
    def run(weights: Weights) -> float:
        found = rounded(weights)
        for near, weight in zip(found[2:-2:2], weights[2:-2:2], strict=True):
            end = float(near.abs().max())
            weight.clamp_(-end, end)
        return step(found)

    return run
