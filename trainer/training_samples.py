"""Training samples: what each level and the texture are trained on.

Level 1 sees the surface, a shell around it, the unit ball and the corners of the domain. Level i > 1, a residual, sees
the surface and the band |f_{i-1}| < delta_{i-1} of the level before, where it is defined (Eq. 3). The texture sees the
colors of the surface, and the band of level 1. Hard examples come during training (mining.py).
"""

from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor

from ..model.errors import UserError
from . import sampling
from .frozen_levels import FrozenLevels
from .mining import find_strays
from .networks.nested import field_and_gradient, nested_field_and_gradient
from .networks.snapshot import Snapshot, random_state, set_random_state
from .shapes.shape import Doubles, Shape


@dataclass(frozen=True, eq=False)
class Pool:
    """N samples of the loss, with the field f_{i-1} of the frozen levels; f_0 = 0."""

    points: Tensor
    """(N, 3), model space; (N, 4) of a shape that moves, with the time in [0, 1]."""
    distance: Tensor | None
    """Signed distance to the surface (N,), NaN where unknown; None where the loss does not need it."""
    normals: Tensor | None
    """Unit normals of the surface (N, 3), or None."""
    frozen: Tensor
    """f_{i-1} at the points (N,)."""
    frozen_gradient: Tensor
    """grad f_{i-1} at the points, with as many columns."""
    colors: Tensor | None = None
    """sRGB in [0, 1], (N, 3), or None."""

    def columns(self) -> list[Tensor | None]:
        """Return what the pool is made of, in the order of its arguments."""
        return [getattr(self, column.name) for column in fields(self)]

    def take(self, index: Tensor | slice) -> "Pool":
        """Return the samples at an index (M,) or a slice."""

        def take(column: Tensor | None) -> Tensor | None:
            return None if column is None else column[index]

        return Pool(
            points=self.points[index],
            distance=take(self.distance),
            normals=take(self.normals),
            frozen=self.frozen[index],
            frozen_gradient=self.frozen_gradient[index],
            colors=take(self.colors),
        )


COLUMNS = len(fields(Pool))


class Sampler:
    """Draws the pools that one level, or the texture, is trained on."""

    def __init__(self, shape: Shape, frozen: FrozenLevels, rng: np.random.Generator) -> None:
        """frozen: the levels before the trained one; all levels for the texture."""
        self._shape, self._rng, self._frozen = shape, rng, frozen
        self._strays = find_strays(shape, frozen, rng)

    def surface(self, count: int) -> Pool:
        """Draw samples of the surface, with normals."""
        drawn = self._shape.surface(count, self._rng)
        return self.pool(drawn.points, distance=np.zeros(count), normals=drawn.normals)

    def volume(self, count: int) -> Pool:
        """Draw samples of Omega_{i-1}, the domain of the level, with their distances."""
        points = self._band_points(count) if self._frozen.levels else self._domain_points(count)
        distance = self._shape.distance(points)
        if self._frozen.levels:  # Far from the surface, a residual learns only that there is none.
            distance = self._frozen.clip(distance)
        return self.pool(points, distance=distance)

    def colors(self, count: int) -> Pool:
        """Draw samples of the surface, with colors."""
        drawn = self._shape.surface(count, self._rng, colors=True)
        return self.pool(drawn.points, colors=drawn.colors)

    def first_band(self, count: int) -> Pool:
        """Draw samples of level 1's band, which contains the surface of every level, for colors that fit all levels.

        `frozen` and `frozen_gradient` of the pool belong to the finest level defined at each sample (Eq. 3).
        """
        frozen = self._frozen
        seeds = self._shape.surface(count, self._rng).points
        points = frozen.tensor(sampling.dithered(seeds, frozen.deltas[0], frozen.in_first_band, count, self._rng))
        f, gradient, _ = nested_field_and_gradient(frozen.levels, frozen.deltas, points)
        return Pool(points, None, None, f, gradient)

    def pool(
        self,
        points: Doubles,
        distance: Doubles | None = None,
        normals: Doubles | None = None,
        colors: Doubles | None = None,
    ) -> Pool:
        """Evaluate the frozen levels at points (N, 3), and return a pool of them and their attributes."""
        tensor = self._frozen.tensor
        positions = tensor(points)
        frozen, frozen_gradient = field_and_gradient(self._frozen.levels, positions)
        return Pool(
            points=positions,
            distance=None if distance is None else tensor(distance),
            normals=None if normals is None else tensor(normals),
            frozen=frozen,
            frozen_gradient=frozen_gradient,
            colors=None if colors is None else tensor(colors),
        )

    def snapshot(self) -> Snapshot:
        """Return the state of the random numbers."""
        return Snapshot({"random": self._rng.bit_generator.state})

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from a snapshot. Raises UserError where it is damaged."""
        try:
            self._rng.bit_generator.state = snapshot.numbers["random"]
        except (KeyError, TypeError, ValueError, OverflowError):
            raise UserError("training: 'random' is not the state of a random generator") from None

    def _domain_points(self, count: int) -> Doubles:
        """Draw points for level 1: in the ball, in the corners of the domain, and in a shell around the surface."""
        config, rng, moving = self._frozen.config, self._rng, self._shape.moving
        seeds = self._shape.surface(count, rng).points
        shell_count, corner_count = int(count * config.first_band_share), int(count * config.corner_share)
        reach = rng.uniform(-config.first_band, config.first_band, (shell_count, 3))
        shell = sampling.shifted(seeds[:shell_count], reach)
        corners = sampling.timed(sampling.corners(corner_count, config.ball_radius, rng), moving, rng)
        ball = sampling.ball(count - shell_count - corner_count, config.ball_radius, rng)
        return np.concatenate((sampling.timed(ball, moving, rng), corners, shell))

    def _band_points(self, count: int) -> Doubles:
        """Draw points of the band for a residual: around the surface (Fig. 3a), and around strays."""
        frozen, rng = self._frozen, self._rng
        seeds = self._shape.surface(count, rng).points
        if len(self._strays):
            seeds = np.concatenate((seeds, rng.choice(self._strays, int(count * frozen.config.stray_share))))
        return sampling.dithered(seeds, frozen.delta, frozen.in_band, count, rng)


class Batches:
    """Draws batches of a pool in random order; every sample comes once before any comes again."""

    def __init__(self, pool: Pool, size: int, generator: torch.Generator) -> None:
        """size: samples of a batch, at most those of the pool; the rest of each round is dropped."""
        self._pool, self._size, self._generator = pool, size, generator
        self._rounds = len(pool.points) // size  # Batches of a round.
        self._shuffle()

    def __next__(self) -> Pool:
        """Draw the next batch."""
        if self._drawn == self._rounds:
            self._shuffle()
        start = self._drawn * self._size
        self._drawn += 1
        return self._shuffled.take(slice(start, start + self._size))

    def snapshot(self) -> Snapshot:
        """Return the number of batches drawn, and the generator's state before the present round."""
        return Snapshot({"drawn": self._drawn}) | self._generator_before

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from a snapshot of the same pool; the caller sets the generator's own state afterwards.

        Raises UserError where the snapshot is damaged.
        """
        set_random_state(self._generator, snapshot)
        self._shuffle()
        self._drawn = snapshot.whole("drawn")
        if self._drawn > self._rounds:
            raise UserError("training: more batches drawn than there are")

    def _shuffle(self) -> None:
        self._generator_before = random_state(self._generator)
        order = torch.randperm(len(self._pool.points), generator=self._generator)
        self._shuffled = self._pool.take(order.to(self._pool.points.device))
        self._drawn = 0
