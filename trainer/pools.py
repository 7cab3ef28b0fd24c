"""The training samples of one level: points, what is known at them, and the frozen levels before it, evaluated once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ..model.errors import UserError
from . import sampling
from .networks import losses
from .networks.nested import field, field_and_gradient, in_band, nested_field_and_gradient
from .networks.network import Weights
from .networks.snapshot import Snapshot
from .shapes.shape import Doubles, Shape

FIRST_BAND = 0.1
"""Half width of the shell around the surface that level 1 sees more of than of the rest of the domain."""
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
STRAY_REACH = 4.0
"""Largest distance, in half widths of the band, that a residual is taught; dithering reaches 3.5."""
STRAY_SHARE = 0.15
"""Strays among the points that a residual's volume samples are dithered from."""
HARD_CANDIDATES = 200_000
"""Points of the band, and as many of the domain, among which hard points are searched for."""
HARD_SUSPECTS = 100_000
"""Most candidates whose distance to the surface is computed."""
HARD_NEAR = 0.2
"""A candidate is suspect where |f| is below this share of the band's half width."""
HARD_LEAST_DISTANCE = 0.12
"""Least distance of a hard point from the surface, in half widths of the band."""
HARD_THIN = 0.001
"""Least distance of a point with the wrong sign, model units, where distances are exact: a thin slit or wall has no
points that are farther from the surface."""
HARD_FEWEST = 16
"""Fewer hard points are none: too few to make batches of."""
HARD_SPREAD = 0.15
"""Spread of new candidates around the hard points known before, in half widths of the band."""
EXCESS = 1.1
"""A point is hard for level 1 where |f_1| is more than this many times the distance."""
EXCESS_CANDIDATES = 50_000
"""Points near the surface among which these are searched for."""
EXCESS_REACH = 0.6
"""Their largest distance from the surface along an axis, in half widths of level 1's shell."""


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
        self._shape, self._frozen, self._deltas, self._device, self._rng = shape, frozen, deltas, device, rng
        self._delta = deltas[-1] if deltas else FIRST_BAND
        self._strays = self._find_strays() if frozen else np.empty((0, 4 if shape.moving else 3))
        self.exact = not (shape.cloud or shape.moving)
        """Whether distances are exact next to the surface: those of a mesh that stands still."""

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
        if self._frozen:  # A stray need not learn how far away the surface is, only that it is not here.
            distance = np.clip(distance, -STRAY_REACH * self._delta, STRAY_REACH * self._delta)
        return self._pool(points, distance=distance)

    def hard(self, weights: Weights, known: Pool | None, count: int, near: float) -> Pool | None:
        """Find points off the surface where f_i, with the level's `weights` as they are now, is badly wrong.

        |f_i| exceeds the distance there, so that rays would step through the surface: a residual overshoots in narrow
        gaps and notches, where level 1 is right. Or a residual has less than losses.LACK of the distance: loose pieces
        of surface appear around such points. Or it has the wrong sign: thin slits are filled, and thin walls are not
        there. All are too few for the level's own samples to hold them.
        known: the hard points that were found before; more are searched for around them. count: at most so many
        candidates of each kind. near: closer than this to the surface a value may exceed the distance. Returns None
        where there are (nearly) no hard points.
        """
        points = self._hard_candidates(known, min(count, HARD_CANDIDATES if self._frozen else EXCESS_CANDIDATES))
        at = self._tensor(points)
        f = np.asarray(field([*self._frozen, weights], at).cpu(), np.float64)
        if self._frozen and self._shape.noise:
            near = np.inf  # Distances to what were noisy points are not exact enough to hold a residual to.
        suspected = np.abs(f) > near
        if self._frozen:
            before = np.abs(np.asarray(field(self._frozen, at).cpu(), np.float64))
            suspected = (suspected & (np.abs(f) > EXCESS * before)) | (np.abs(f) < HARD_NEAR * self._delta)
        suspect = self._rng.permutation(np.flatnonzero(suspected))[:HARD_SUSPECTS]
        points, f = points[suspect], f[suspect]
        if not len(points):
            return None
        distance = self._shape.distance(points)
        size, reach = np.abs(distance), STRAY_REACH * self._delta
        wrong = (np.abs(f) > EXCESS * size) & (size > near)
        if self._frozen:
            lacks = f * np.sign(distance) < losses.LACK * size
            wrong |= lacks & (size > HARD_LEAST_DISTANCE * self._delta)
            if self.exact:
                wrong |= (f * distance < 0) & (size > HARD_THIN)
        if np.count_nonzero(wrong) < HARD_FEWEST:  # no point is wrong whose distance is NaN
            return None
        return self.known(points[wrong], np.clip(distance[wrong], -reach, reach))

    def _hard_candidates(self, known: Pool | None, count: int) -> Doubles:
        """Draw points of Omega_{i-1} among which hard points are searched for, around `known` ones, too. (M, 3)."""
        seeds = self._shape.surface(count, self._rng).points
        reach = 2 * self._delta if self._frozen else EXCESS_REACH * self._delta
        candidates = [sampling.shifted(seeds, self._rng.uniform(-reach, reach, (len(seeds), 3)))]
        if self._frozen:
            candidates.insert(0, self._timed(sampling.domain(count, self._rng)))
        if known is not None:
            around = np.asarray(known.points.cpu(), np.float64)
            around = around[self._rng.integers(len(around), size=count // 4)]
            spread = self._rng.normal(scale=HARD_SPREAD * self._delta, size=(len(around), 3))
            candidates.append(sampling.shifted(around, spread))
        points = np.concatenate(candidates)
        return points[self._in_band(points)]

    def known(self, points: Doubles, distance: Doubles) -> Pool:
        """Make a pool of points (N, 3) whose distances (N,) are known already."""
        return self._pool(points, distance=distance)

    def snapshot(self) -> Snapshot:
        """Return the state of the random numbers that further samples are drawn by."""
        return Snapshot({"random": self._rng.bit_generator.state})

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is none."""
        try:
            self._rng.bit_generator.state = snapshot.numbers["random"]
        except (KeyError, TypeError, ValueError, OverflowError):
            raise UserError("training: 'random' is not the state of a generator of random numbers") from None

    def coloured(self, count: int) -> Pool:
        """Draw samples of the surface, with colours."""
        drawn = self._shape.surface(count, self._rng, colours=True)
        return self._pool(drawn.points, colours=drawn.colours)

    def band(self, count: int) -> Pool:
        """Draw samples of the first level's band, which holds every level's surface, for colours that fit all of them.

        `frozen` and `frozen_gradient` of the pool are those of the finest level defined at each sample (Eq. 3).
        """
        seeds = self._shape.surface(count, self._rng).points
        points = self._tensor(sampling.dithered(seeds, self._deltas[0], self._in_first_band, count, self._rng))
        f, gradient, _ = nested_field_and_gradient(self._frozen, self._deltas, points)
        return Pool(points, None, None, f, gradient)

    def _volume_points(self, count: int) -> Doubles:
        seeds = self._shape.surface(count, self._rng).points
        if self._frozen:
            if len(self._strays):
                seeds = np.concatenate((seeds, self._rng.choice(self._strays, int(count * STRAY_SHARE))))
            return sampling.dithered(seeds, self._delta, self._in_band, count, self._rng)
        near_count, corner_count = int(count * FIRST_BAND_SHARE), int(count * CORNER_SHARE)
        near = sampling.shifted(seeds[:near_count], self._rng.uniform(-self._delta, self._delta, (near_count, 3)))
        corners = self._timed(sampling.corners(corner_count, BALL_RADIUS, self._rng))
        far = self._timed(sampling.ball(count - near_count - corner_count, BALL_RADIUS, self._rng))
        return np.concatenate((far, corners, near))

    def _find_strays(self) -> Doubles:
        """Find points of the band where the levels before are wrong by half its width or more. Returns (M, 3).

        New pieces of surface may appear there. Dithering around the surface alone sees such points rarely (within thin
        parts) or never (far away). They are drawn with a probability in proportion to the squares of their errors.
        """
        points = self._timed(sampling.domain(STRAY_CANDIDATES, self._rng))
        points = points[self._in_band(points)][:STRAY_SUSPECTS]
        f = np.asarray(field(self._frozen, self._tensor(points)).cpu(), np.float64)
        error = np.abs(self._shape.distance(points) - f)
        wrong = error > STRAY_ERROR * self._delta
        points, weight = points[wrong], error[wrong] ** 2
        return self._rng.choice(points, STRAYS, p=weight / weight.sum()) if len(points) else points

    def _timed(self, points: Doubles) -> Doubles:
        return sampling.timed(points, self._shape.moving, self._rng)

    def _in_first_band(self, points: Doubles) -> NDArray[np.bool_]:
        return np.asarray(in_band(self._frozen[:1], self._deltas[:1], self._tensor(points)).cpu())

    def _in_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Tell at which points (N, 3) the level that is to be trained is defined: (N,)."""
        return np.asarray(in_band(self._frozen, self._deltas, self._tensor(points)).cpu())

    def _tensor(self, array: Doubles) -> Tensor:
        return torch.from_numpy(array.astype(np.float32)).to(self._device)

    def _pool(
        self,
        points: Doubles,
        distance: Doubles | None = None,
        normals: Doubles | None = None,
        colours: Doubles | None = None,
    ) -> Pool:
        positions = self._tensor(points)
        frozen, frozen_gradient = field_and_gradient(self._frozen, positions)
        return Pool(
            points=positions,
            distance=None if distance is None else self._tensor(distance),
            normals=None if normals is None else self._tensor(normals),
            frozen=frozen,
            frozen_gradient=frozen_gradient,
            colours=None if colours is None else self._tensor(colours),
        )
