"""Hard points: where the level that is trained is badly wrong, off the surface, at too few points to be learnt."""

from functools import partial

import numpy as np
import torch

from . import sampling
from .before import Before
from .networks import losses
from .networks.network import Weights
from .networks.snapshot import Snapshot
from .shapes.shape import Doubles, Shape
from .thin import ThinPlaces

CANDIDATES = 200_000
"""Points of the band, and as many of the domain, among which hard points are searched for."""
SUSPECTS = 100_000
"""Most candidates whose distance to the surface is computed."""
NEAR = 0.2
"""A candidate is suspect where |f| is below this share of the band's half width."""
LEAST_DISTANCE = 0.12
"""Least distance of a hard point from the surface, in half widths of the band."""
WRONG_SIGN = 0.001
"""Least distance of a point with the wrong sign, model units, where distances are exact."""
THIN_CANDIDATES = 400_000
"""Most points next to the surface among which thin places are searched for."""
THIN_TIMES = 5
"""Most hard points in and around thin places for each other one."""
THIN_REPEATED = 64
"""How often each of them is there at most."""
FEWEST = 16
"""Fewer hard points are none: too few to make batches of."""
SPREAD = 0.15
"""Spread of new candidates around the hard points known before, in half widths of the band."""
EXCESS = 1.1
"""A point is hard for level 1 where |f_1| is more than this many times the distance."""
EXCESS_CANDIDATES = 50_000
"""Points near the surface among which these are searched for."""
EXCESS_REACH = 0.6
"""Their largest distance from the surface along an axis, in half widths of level 1's shell."""


def exact(shape: Shape) -> bool:
    """Tell whether distances are exact next to the surface: those of a mesh that stands still."""
    return not (shape.cloud or shape.moving)


class HardPoints:
    """The search for the hard points of one level."""

    def __init__(self, shape: Shape, before: Before, rng: np.random.Generator) -> None:
        """before: the levels before. rng: draws candidates."""
        self.times = 1.0
        """How many times as many points were found the last time as without thin places."""
        self._shape, self._before, self._rng = shape, before, rng
        self._thin = ThinPlaces(shape, rng) if before.levels and exact(shape) else None

    def find(self, weights: Weights, known: Doubles | None, count: int, near: float) -> tuple[Doubles, Doubles] | None:
        """Find points off the surface where f_i, with the level's `weights` as they are now, is badly wrong.

        |f_i| exceeds the distance there, so that rays would step through the surface: a residual overshoots in narrow
        gaps and notches, where level 1 is right. Or a residual has less than losses.LACK of the distance: loose pieces
        of surface appear around such points. Or it has the wrong sign: thin slits are filled, and thin walls are not
        there. All are too few for the level's own samples to hold them.
        known: the hard points that were found before (N, 3); more are searched for around them. count: at most so many
        candidates of each kind. near: closer than this to the surface a value may exceed the distance. Returns points
        (M, 3) and what f is to be there (M,), or None where there are (nearly) none.
        """
        points, aim = self._wrong(weights, known, count, near)
        others, self.times = len(points), 1.0
        if self._thin is not None:
            level = partial(self._field, weights)
            self._thin.look(level, min(2 * count, THIN_CANDIDATES))
            thin, thin_aim = self._thin.hard(level)
            if len(thin):  # With repetition: they are few.
                drawn = self._rng.integers(
                    len(thin), size=min(THIN_REPEATED * len(thin), THIN_TIMES * max(others, FEWEST))
                )
                self.times += len(drawn) / max(others, FEWEST)
                points, aim = np.concatenate((points, thin[drawn])), np.concatenate((aim, thin_aim[drawn]))
        if len(points) < FEWEST:
            return None
        return points, self._before.taught(aim)

    def lost(self, weights: Weights) -> tuple[Doubles, Doubles]:
        """Find the thin places where f_i, with the level's `weights` as they are now, has the wrong sign.

        Returns points (M, 3) and what f is to be there (M,).
        """
        if self._thin is None:
            return np.empty((0, 3)), np.empty(0)
        points, aim = self._thin.lost(partial(self._field, weights))
        return points, self._before.taught(aim)

    def snapshot(self) -> Snapshot:
        """Return the thin places that are held by now."""
        return Snapshot() if self._thin is None else Snapshot(tensors={"thin": torch.from_numpy(self._thin.known)})

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is none."""
        if self._thin is not None and "thin" in snapshot.tensors:
            known = snapshot.tensors["thin"]
            rows = known.new_empty((len(known), 4), dtype=torch.float32) if known.ndim else known
            self._thin.known = snapshot.tensor("thin", rows).numpy()

    def _field(self, weights: Weights, points: Doubles) -> Doubles:
        return self._before.field(points, weights)

    def _wrong(self, weights: Weights, known: Doubles | None, count: int, near: float) -> tuple[Doubles, Doubles]:
        """Find those that are not in thin places, as `find` does. Returns points (M, 3) and distances (M,)."""
        before, residual = self._before, bool(self._before.levels)
        points = self._candidates(known, min(count, CANDIDATES if residual else EXCESS_CANDIDATES))
        f = self._field(weights, points)
        if residual and self._shape.noise:
            near = np.inf  # Distances to what were noisy points are not exact enough to hold a residual to.
        suspected = np.abs(f) > near
        if residual:
            exceeds = np.abs(f) > EXCESS * np.abs(before.field(points))
            suspected = (suspected & exceeds) | (np.abs(f) < NEAR * before.delta)
        suspect = self._rng.permutation(np.flatnonzero(suspected))[:SUSPECTS]
        points, f = points[suspect], f[suspect]
        distance = self._shape.distance(points) if len(points) else np.empty(0)
        size = np.abs(distance)
        wrong = (np.abs(f) > EXCESS * size) & (size > near)
        if residual:
            lacks = f * np.sign(distance) < losses.LACK * size
            wrong |= lacks & (size > LEAST_DISTANCE * before.delta)
            if exact(self._shape):
                wrong |= (f * distance < 0) & (size > WRONG_SIGN)
        return points[wrong], distance[wrong]  # no point is wrong whose distance is NaN

    def _candidates(self, known: Doubles | None, count: int) -> Doubles:
        """Draw points of Omega_{i-1} among which hard points are searched for, around `known` ones, too. (M, 3)."""
        before, rng = self._before, self._rng
        seeds = self._shape.surface(count, rng).points
        reach = (2 if before.levels else EXCESS_REACH) * before.delta
        candidates = [sampling.shifted(seeds, rng.uniform(-reach, reach, (len(seeds), 3)))]
        if before.levels:
            candidates.insert(0, sampling.timed(sampling.domain(count, rng), self._shape.moving, rng))
        if known is not None:
            around = known[rng.integers(len(known), size=count // 4)]
            spread = rng.normal(scale=SPREAD * before.delta, size=(len(around), 3))
            candidates.append(sampling.shifted(around, spread))
        points = np.concatenate(candidates)
        return points[before.in_band(points)]
