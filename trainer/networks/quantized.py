"""Quantization in every training step, so that training compensates the rounding (model/quantize.py)."""

import torch

from ...model import quantize
from .fit import Step
from .network import Weights, from_model, to_model


@torch.no_grad()
def quantized(weights: Weights) -> Weights:
    """Return the nearest quantized weights, with the same .grad tensors: gradients ignore the rounding."""
    rounded = [w.to(weights[0].device) for w in from_model(quantize.quantized(to_model(weights)))]
    for near, weight in zip(rounded, weights, strict=True):
        near.grad = weight.grad
    return rounded


def quantized_step(step: Step) -> Step:
    """Evaluate a step at the quantized weights, and clamp the hidden layers' matrices to the largest multiples."""

    @torch.no_grad()
    def run(weights: Weights) -> float:
        rounded = quantized(weights)
        for near, weight in zip(rounded[2:-2:2], weights[2:-2:2], strict=True):
            largest = float(near.abs().max())
            weight.clamp_(-largest, largest)
        return step(rounded)

    return run
