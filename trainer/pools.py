"""The training samples of one level: points, what is known at them, and the frozen levels before it, evaluated once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..model.errors import UserError
from . import sampling
from .before import FIRST_BAND, Before
from .hard import HardPoints
from .networks.nested import field_and_gradient, nested_field_and_gradient
from .networks.network import Weights
from .networks.snapshot import Snapshot
from .shapes.shape import Doubles, Shape

FIRST_BAND_SHARE = 0.3
"""Share of level 1's volume samples in that shell."""
BALL_RADIUS = 1.03
"""Radius of the ball that the rest of these samples are in: rays are traced, and distances used, within 1."""
CORNER_SHARE = 0.06
"""Share of these samples outside the ball, in the corners of the domain, where no surface may appear either."""
STRAY_CANDIDATES = 400_000
"""Points of the domain among which strays are searched for."""
STRAY_SUSPECTS = 50_000
"""Most candidates whose distance to the surface is computed: a level that learnt little has a band full of them."""
STRAYS = 4096
"""Strays that are kept."""
STRAY_ERROR = 0.5
"""Smallest error of a stray, in half widths of the band."""
STRAY_SHARE = 0.15
"""Strays among the points that a residual's volume samples are dithered from."""


@dataclass(frozen=True, eq=False)
class Pool:
    """Samples of the loss, with the field f_{i-1} of the levels that are trained already; f_0 = 0."""

    points: Tensor
    """(N, 3), model space; (N, 4) of a shape that moves, with the time in [0, 1]."""
    distance: Tensor | None
    """Signed distance to the surface (N,), NaN where it is not known; None where the loss does not ask for it."""
    normals: Tensor | None
    """Unit normals of the surface (N, 3), or None."""
    frozen: Tensor
    """f_{i-1} at the points (N,)."""
    frozen_gradient: Tensor
    """grad f_{i-1} at the points, with as many columns."""
    colours: Tensor | None = None
    """sRGB in [0, 1], (N, 3), or None."""

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
            colours=take(self.colours),
        )

    def and_then(self, other: "Pool") -> "Pool":
        """Return the samples of both."""

        def join(one: Tensor | None, two: Tensor | None) -> Tensor | None:
            return None if one is None or two is None else torch.cat((one, two))

        return Pool(
            points=torch.cat((self.points, other.points)),
            distance=join(self.distance, other.distance),
            normals=join(self.normals, other.normals),
            frozen=torch.cat((self.frozen, other.frozen)),
            frozen_gradient=torch.cat((self.frozen_gradient, other.frozen_gradient)),
            colours=join(self.colours, other.colours),
        )


class Sampler:
    """Draws the pools that one level, or the texture, is trained on."""

    def __init__(
        self,
        shape: Shape,
        frozen: Sequence[Weights],
        deltas: Sequence[float],
        device: torch.device,
        rng: np.random.Generator,
    ) -> None:
        """frozen: the levels before. deltas: the half widths of their bands. device: where the pools are."""
        self._shape, self._rng, self._before = shape, rng, Before(frozen, deltas, device)
        self._strays = self._find_strays() if frozen else np.empty((0, 4 if shape.moving else 3))
        self._hard = HardPoints(shape, self._before, rng)

    def surface(self, count: int) -> Pool:
        """Draw samples of the surface, with normals."""
        drawn = self._shape.surface(count, self._rng)
        return self._pool(drawn.points, distance=np.zeros(count), normals=drawn.normals)

    def volume(self, count: int) -> Pool:
        """Draw samples of Omega_{i-1}, where the level is defined, with their distances.

        For level 1, they are in a shell around the surface, in the ball that rays are traced in, and a few in the
        corners of the domain; for a residual, all are in the band |f_{i-1}| < delta_{i-1}.
        """
        points = self._volume_points(count)
        distance = self._shape.distance(points)
        if self._before.levels:  # A stray need not learn how far away the surface is, only that it is not here.
            distance = self._before.taught(distance)
        return self._pool(points, distance=distance)

    def hard(self, weights: Weights, known: Pool | None, count: int, near: float) -> Pool | None:
        """Find points off the surface where f_i is badly wrong, as `HardPoints.find` does; None where there are none.

        weights: of the level as it is now. known: the hard points that were found before.
        """
        around = None if known is None else np.asarray(known.points.cpu(), np.float64)
        found = self._hard.find(weights, around, count, near)
        return None if found is None else self.known(*found)

    def lost(self, weights: Weights) -> Pool:
        """Find the thin places where f_i has the wrong sign, as `HardPoints.lost` does."""
        return self.known(*self._hard.lost(weights))

    @property
    def hard_times(self) -> float:
        """How many times as many hard points were found the last time as without those of thin places."""
        return self._hard.times

    def known(self, points: Doubles, distance: Doubles) -> Pool:
        """Make a pool of points (N, 3) whose distances (N,) are known already."""
        return self._pool(points, distance=distance)

    def snapshot(self) -> Snapshot:
        """Return the state of the random numbers that further samples are drawn by, and what is held by now."""
        return Snapshot({"random": self._rng.bit_generator.state}) | self._hard.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is none."""
        self._hard.restore(snapshot)
        try:
            self._rng.bit_generator.state = snapshot.numbers["random"]
        except (KeyError, TypeError, ValueError, OverflowError):
            raise UserError("training: 'random' is not the state of a generator of random numbers") from None

    def coloured(self, count: int) -> Pool:
        """Draw samples of the surface, with colours."""
        drawn = self._shape.surface(count, self._rng, colors=True)
        return self._pool(drawn.points, colours=drawn.colors)

    def band(self, count: int) -> Pool:
        """Draw samples of the first level's band, which holds every level's surface, for colours that fit all of them.

        `frozen` and `frozen_gradient` of the pool are those of the finest level defined at each sample (Eq. 3).
        """
        seeds = self._shape.surface(count, self._rng).points
        before = self._before
        points = before.tensor(sampling.dithered(seeds, before.deltas[0], before.in_first_band, count, self._rng))
        f, gradient, _ = nested_field_and_gradient(before.levels, before.deltas, points)
        return Pool(points, None, None, f, gradient)

    def _volume_points(self, count: int) -> Doubles:
        seeds = self._shape.surface(count, self._rng).points
        if self._before.levels:
            if len(self._strays):
                seeds = np.concatenate((seeds, self._rng.choice(self._strays, int(count * STRAY_SHARE))))
            return sampling.dithered(seeds, self._before.delta, self._before.in_band, count, self._rng)
        near_count, corner_count = int(count * FIRST_BAND_SHARE), int(count * CORNER_SHARE)
        near = sampling.shifted(seeds[:near_count], self._rng.uniform(-FIRST_BAND, FIRST_BAND, (near_count, 3)))
        corners = self._timed(sampling.corners(corner_count, BALL_RADIUS, self._rng))
        far = self._timed(sampling.ball(count - near_count - corner_count, BALL_RADIUS, self._rng))
        return np.concatenate((far, corners, near))

    def _find_strays(self) -> Doubles:
        """Find points of the band where the levels before are wrong by half its width or more. Returns (M, 3).

        New pieces of surface may appear there. Dithering around the surface alone sees such points rarely (within thin
        parts) or never (far away). They are drawn with a probability in proportion to the squares of their errors.
        """
        points = self._timed(sampling.domain(STRAY_CANDIDATES, self._rng))
        points = points[self._before.in_band(points)][:STRAY_SUSPECTS]
        error = np.abs(self._shape.distance(points) - self._before.field(points))
        wrong = error > STRAY_ERROR * self._before.delta
        points, weight = points[wrong], error[wrong] ** 2
        return self._rng.choice(points, STRAYS, p=weight / weight.sum()) if len(points) else points

    def _timed(self, points: Doubles) -> Doubles:
        return sampling.timed(points, self._shape.moving, self._rng)

    def _pool(
        self,
        points: Doubles,
        distance: Doubles | None = None,
        normals: Doubles | None = None,
        colours: Doubles | None = None,
    ) -> Pool:
        positions = self._before.tensor(points)
        frozen, frozen_gradient = field_and_gradient(self._before.levels, positions)
        return Pool(
            points=positions,
            distance=None if distance is None else self._before.tensor(distance),
            normals=None if normals is None else self._before.tensor(normals),
            frozen=frozen,
            frozen_gradient=frozen_gradient,
            colours=None if colours is None else self._before.tensor(colours),
        )
