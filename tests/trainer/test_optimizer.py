"""The optimizers take the steps of torch's, without what its classes import; the rate follows a schedule."""

import subprocess
import sys

import pytest
import torch

from mplicits.trainer.networks.fit import WARM_UP, schedule
from mplicits.trainer.networks.muon import Muon, orthogonal

OURS = """
import sys
import torch
from mplicits.trainer.networks.muon import ITERATIONS, MOMENTUM, ROOT_MEAN_SQUARE, Muon
from mplicits.trainer.networks.network import initial
from mplicits.trainer.networks.optimizer import BETAS, Optimizer

def taken(kind, weights, last):
    "Takes five steps. Returns copies of the first weights, and the gradients."
    first = [weight.clone() for weight in weights]
    gradients = [[torch.randn(weight.shape) for weight in weights] for _ in range(5)]
    optimizer = kind(weights, 0.02, last)
    for step, drawn in enumerate(gradients):
        for weight, gradient in zip(weights, drawn):
            weight.grad.copy_(gradient)
        optimizer.step(1 - 0.1 * step)
        assert not any(weight.grad.any() for weight in weights)
    return first, gradients

torch.manual_seed(0)
adam_weights = [torch.randn(size) for size in ((8, 3), (8,), (1, 8), (1,))]
adam_first, adam_gradients = taken(Optimizer, adam_weights, 0.1)
muon_weights = initial((64, 3), 20.0, 1, torch.Generator().manual_seed(0))
muon_first, muon_gradients = taken(Muon, muon_weights, 1.0)
print("torch._dynamo" in sys.modules)
"""
"""Takes the steps of our optimizers, and tells whether anything imported a compiler."""
THEIRS = """
def set_gradients(weights, drawn):
    for weight, gradient in zip(weights, drawn):
        weight.grad = gradient

theirs = adam_first
adam = torch.optim.Adam([{"params": theirs[:2]}, {"params": theirs[2:]}], betas=BETAS, eps=1e-12, fused=True)
for step, drawn in enumerate(adam_gradients):
    set_gradients(theirs, drawn)
    for group, rate in zip(adam.param_groups, (0.02, 0.002)):
        group["lr"] = (1 - 0.1 * step) * rate
    adam.step()
print(all(torch.equal(a, b) for a, b in zip(adam_weights, theirs)))

theirs = muon_first
hidden, others = theirs[2:-2:2], [weight for weight in theirs if weight.shape != (64, 64)]
muon = torch.optim.Muon(hidden, weight_decay=0, momentum=MOMENTUM, ns_steps=ITERATIONS, adjust_lr_fn="match_rms_adamw")
adam = torch.optim.Adam(others, betas=(0.9, 0.99), eps=1e-12)
for step, drawn in enumerate(muon_gradients):
    set_gradients(theirs, drawn)
    muon.param_groups[0]["lr"] = (1 - 0.1 * step) * 0.02 * ROOT_MEAN_SQUARE / 0.2  # torch has 0.2
    adam.param_groups[0]["lr"] = (1 - 0.1 * step) * 0.02
    muon.step()
    adam.step()
print(max((a - b).abs().max().item() for a, b in zip(muon_weights, theirs)))
"""


@pytest.mark.slow
def test_steps_match_torch_optim() -> None:
    run = subprocess.run([sys.executable, "-c", OURS + THEIRS], capture_output=True, text=True, check=True)
    imports, same, difference = run.stdout.split()
    assert (imports, same) == ("False", "True")
    assert float(difference) < 1e-3, "5 steps of up to 0.02; torch rounds products to 16 bits"


def test_singular_values_come_near_one() -> None:
    matrices = torch.randn(3, 40, 40, generator=torch.Generator().manual_seed(0))
    found = torch.linalg.svdvals(orthogonal(matrices))
    assert found.max() < 1.3
    assert (found > 0.5).double().mean() > 0.9
    directions = torch.linalg.svd(matrices)
    polar = directions.U @ directions.Vh
    cosines = (orthogonal(matrices) * polar).sum(dim=(1, 2)) / orthogonal(matrices).norm(dim=(1, 2)) / 40**0.5
    assert cosines.min() > 0.95


def test_a_network_without_hidden_layers_has_no_matrices() -> None:
    weights = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.zeros(1)]
    optimizer = Muon(weights, 0.02, 0.1)
    for weight in weights:
        assert weight.grad is not None
        weight.grad += 1
    optimizer.step(1.0)
    assert all(weight.all() for weight in weights)


def test_the_rate_rises_and_then_falls_along_a_cosine() -> None:
    shares = (0, WARM_UP / 4, WARM_UP / 2, WARM_UP, 0.5 + 0.5 * WARM_UP, 1)
    assert [schedule(share) for share in shares] == pytest.approx([0, 0.25, 0.5, 1, 0.5, 0])
