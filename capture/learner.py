"""The training steps of a scene on rays, and their state for `--resume`."""

import torch
from torch import Tensor

from ..model.errors import UserError
from ..trainer.networks.fit import schedule
from ..trainer.networks.snapshot import Snapshot, random_state, set_random_state
from .rays import RayBatches, Rays
from .rendering import Effort, Factors, loss_of, render
from .scene import MultiscaleScene

RATE, RADIANCE_RATE, SHARPNESS_RATE = 3e-3, 5e-3, 1e-2
"""Peak rates of the levels' and the radiance network's layers up to 64 wide, and of log s."""
LOWEST = 0.05  # last rate, as a share of the peak
COARSE = 0.2  # share of the schedule in which level 1 trains alone; the same share later, each finer level joins
ANNEALED = 0.15  # without masks, `anneal` of `opacities` rises to 1 in this share of the schedule
BLUNT, SHARP, SHARPENED = 20.0, 100.0, 0.8
"""With masks, the lower bound of s rises from BLUNT to SHARP in the share SHARPENED of the schedule.

A free s stays low while the shape is wrong, and the shape stays wrong while s is low: outlines are 1 / s wide.
"""


class Learner:
    """A scene, its optimizers, and their random numbers."""

    def __init__(self, scene: MultiscaleScene, rays: Rays, count: int, background: float, seed: int) -> None:
        """rays: all training rays. count: rays per step. background: gray, sRGB, behind photographs without masks."""
        self.scene, self._background = scene, background
        self._generator = torch.Generator().manual_seed(seed)
        self._batches = RayBatches(rays, count, self._generator)
        self._optimizers = scene.optimizers(RATE, RADIANCE_RATE, SHARPNESS_RATE)
        self.effort, self.factors = Effort(), Factors(inside=self._batches.inside)

    def step(self, share: float) -> float:
        """Take a step at a share of the schedule, in [0, 1]. Returns the loss."""
        scene = self.scene
        scene.field.active = min(len(scene.levels), 1 + int(share / COARSE))
        rays = next(self._batches)
        anneal = min(1.0, share / ANNEALED)
        if rays.inside is not None:
            anneal, scene.least_sharpness = 1.0, BLUNT * (SHARP / BLUNT) ** min(1.0, share / SHARPENED)
        loss = loss_of(render(scene, rays, self.effort, self._generator, anneal), rays, self.factors, self._background)
        scene.backward(loss)
        for _, optimizer in self._optimizers:
            optimizer.step(max(LOWEST, schedule(share)))
        return float(loss.detach())

    def snapshot(self) -> Snapshot:
        """Return the state."""
        state = random_state(self._generator)
        for i, (tensors, optimizer) in enumerate(self._optimizers):
            named = {f"parameter.{k}": tensor.detach() for k, tensor in enumerate(tensors)}
            state |= (Snapshot(tensors=named) | optimizer.snapshot()).inside(f"part{i}")
        return state

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a snapshot. Raises UserError if it belongs to a scene of other sizes."""
        with torch.no_grad():
            for i, (tensors, optimizer) in enumerate(self._optimizers):
                state = snapshot.of(f"part{i}")
                for k, tensor in enumerate(tensors):
                    tensor.copy_(state.tensor(f"parameter.{k}", tensor))
                optimizer.restore(state)
        set_random_state(self._generator, snapshot)

    def check(self) -> None:
        """Raise UserError if a weight is not finite."""
        tensors: list[Tensor] = [tensor for tensors, _ in self._optimizers for tensor in tensors]
        if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors):
            raise UserError("the reconstruction diverged; try another --seed, or smaller --omega")
