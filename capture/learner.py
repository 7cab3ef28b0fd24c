"""Learning a scene from rays: its steps, and its state, from which an interrupted one goes on."""

import torch
from torch import Tensor

from ..model.errors import UserError
from ..trainer.networks.fit import schedule
from ..trainer.networks.snapshot import Snapshot, random_state, set_random_state
from .bundle import RayBatches, Rays
from .rendering import Effort, Factors, loss_of, render
from .scene import MultiscaleScene

RATE, RADIANCE_RATE, SHARPNESS_RATE = 3e-3, 5e-3, 1e-2
"""Peak rates: of the levels' and the radiance's layers up to 64 wide, and of log s."""
LOWEST = 0.05
"""The rate ends at this share of its peak."""
COARSE = 0.2
"""Share of the schedule in which level 1 learns alone; each finer level comes in as much later."""
ANNEALED = 0.15
"""Share of the schedule after which sections that a ray leaves through no longer count, where there are no masks."""

BLUNT, SHARP, SHARPENED = 20.0, 100.0, 0.8
"""With masks, s is at least the first at the start of the schedule and the second from the last share of it on. An s
that is only learnt stays low as long as the shape is wrong, and so does the shape: outlines are as wide as 1 / s."""


class Learner:
    """A scene, its optimiser, and the random numbers of both."""

    def __init__(self, scene: MultiscaleScene, rays: Rays, count: int, background: float, seed: int) -> None:
        """rays: to learn from. count: of a step. background: behind photographs without masks, grey, sRGB."""
        self.scene, self._background = scene, background
        self._generator = torch.Generator().manual_seed(seed)
        self._batches = RayBatches(rays, count, self._generator)
        self._learnt = scene.optimisers(RATE, RADIANCE_RATE, SHARPNESS_RATE)
        self.effort, self.factors = Effort(), Factors(inside=self._batches.inside)

    def step(self, share: float) -> float:
        """Take a step at a share of the schedule, in [0, 1]. Returns the loss."""
        scene = self.scene
        scene.field.active = min(len(scene.levels), 1 + int(share / COARSE))
        rays = next(self._batches)
        if rays.inside is not None:
            scene.least_sharpness = BLUNT * (SHARP / BLUNT) ** min(1.0, share / SHARPENED)
        anneal = 1.0 if rays.inside is not None else min(1.0, share / ANNEALED)
        loss = loss_of(render(scene, rays, self.effort, self._generator, anneal), rays, self.factors, self._background)
        scene.backward(loss)
        for _, optimiser in self._learnt:
            optimiser.step(max(LOWEST, schedule(share)))
        return float(loss.detach())

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        state = random_state(self._generator)
        for i, (tensors, optimiser) in enumerate(self._learnt):
            named = {f"parameter.{k}": tensor.detach() for k, tensor in enumerate(tensors)}
            state |= (Snapshot(tensors=named) | optimiser.snapshot()).inside(f"part{i}")
        return state

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is not of a scene of these sizes."""
        with torch.no_grad():
            for i, (tensors, optimiser) in enumerate(self._learnt):
                state = snapshot.of(f"part{i}")
                for k, tensor in enumerate(tensors):
                    tensor.copy_(state.tensor(f"parameter.{k}", tensor))
                optimiser.restore(state)
        set_random_state(self._generator, snapshot)

    def check(self) -> None:
        """Raise UserError where a weight is no longer finite."""
        if not all(bool(torch.isfinite(tensor).all()) for tensor in self._tensors()):
            raise UserError("the reconstruction diverged; try another --seed, or smaller --omega")

    def _tensors(self) -> list[Tensor]:
        return [tensor for tensors, _ in self._learnt for tensor in tensors]
