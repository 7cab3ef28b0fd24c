"""Batches of a pool's samples in random order, which can be gone on with where a training was cut short."""

import torch

from ..model.errors import UserError
from .networks.snapshot import Snapshot, random_state, set_random_state
from .pools import Pool


class Batches:
    """Draws batches without end; no sample comes again before all have come once."""

    def __init__(self, pool: Pool, size: int, generator: torch.Generator) -> None:
        """size: of a batch, at most the number of samples; what is left over at the end of a round is dropped."""
        self._pool, self._size, self._generator = pool, size, generator
        self._rounds = len(pool.points) // size
        self._mix()

    def __next__(self) -> Pool:
        """Draw the next batch."""
        if self._drawn == self._rounds:
            self._mix()
        start = self._drawn * self._size
        self._drawn += 1
        return self._mixed.take(slice(start, start + self._size))

    def snapshot(self) -> Snapshot:
        """Return where in its round this is, and the generator's state from which the round's order follows."""
        return Snapshot({"drawn": self._drawn}) | self._began

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot of batches of the same pool; the generator's own state is the caller's to set after.

        Raises UserError where it is none.
        """
        set_random_state(self._generator, snapshot)
        self._mix()
        self._drawn = snapshot.whole("drawn")
        if self._drawn > self._rounds:
            raise UserError("training: more batches drawn than there are")

    def _mix(self) -> None:
        """Begin a round."""
        self._began = random_state(self._generator)
        order = torch.randperm(len(self._pool.points), generator=self._generator)
        self._mixed = self._pool.take(order.to(self._pool.points.device))
        self._drawn = 0
