"""The optimizer takes the steps of torch.optim.Adam, without what that class imports; its rate follows a schedule."""

import subprocess
import sys

import pytest

from mplicits.trainer.networks.fit import WARM_UP, schedule

PROGRAM = """
import sys, torch
from mplicits.trainer.networks.optimizer import BETAS, Optimizer

torch.manual_seed(0)
sizes = (8, 3), (8,), (1, 8), (1,)
ours = [torch.randn(size) for size in sizes]
theirs = [weight.clone() for weight in ours]
gradients = [[torch.randn(size) for size in sizes] for _ in range(5)]
optimizer = Optimizer(ours, 0.02, 0.1)
for step, drawn in enumerate(gradients):
    for weight, gradient in zip(ours, drawn):
        weight.grad.copy_(gradient)
    optimizer.step(1 - 0.1 * step)
    assert not any(weight.grad.any() for weight in ours)
print("torch._dynamo" in sys.modules)
adam = torch.optim.Adam([{"params": theirs[:2]}, {"params": theirs[2:]}], betas=BETAS, eps=1e-12, fused=True)
for step, drawn in enumerate(gradients):
    for weight, gradient in zip(theirs, drawn):
        weight.grad = gradient
    for group, rate in zip(adam.param_groups, (0.02, 0.002)):
        group["lr"] = (1 - 0.1 * step) * rate
    adam.step()
print(all(torch.equal(a, b) for a, b in zip(ours, theirs)))
"""


def test_steps_match_torch_optim_adam() -> None:
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["False", "True"]


def test_the_rate_rises_and_then_falls_along_a_cosine() -> None:
    shares = (0, WARM_UP / 4, WARM_UP / 2, WARM_UP, 0.5 + 0.5 * WARM_UP, 1)
    assert [schedule(share) for share in shares] == pytest.approx([0, 0.25, 0.5, 1, 0.5, 0])
