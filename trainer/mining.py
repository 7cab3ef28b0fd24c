"""Hard-example mining: points off the surface where the level under training is badly wrong.

Such points are too few for the level's own samples to correct them. They are of two kinds:

- Anywhere off the surface: |f| exceeds the distance, so that sphere tracing would step through the surface; or, for a
  residual, f is much too small or has the wrong sign, so that loose components of surface appear.
- Thin features of a mesh (slits, walls, sharp edges), which a residual fills or loses. Features once found stay known.

Strays are a third kind: points of the band where the frozen levels are wrong before the training of level i starts.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import torch

from . import sampling
from .frozen_levels import FrozenLevels
from .mining_config import MiningConfig, ThinConfig
from .networks import losses
from .networks.network import Weights
from .networks.snapshot import Snapshot
from .shapes.shape import Doubles, Shape

Field = sampling.Distance
"""Maps points (N, 3) to the values (N,) of a field."""


@dataclass(frozen=True, eq=False)
class HardExamples:
    """Points off the surface where a level is badly wrong."""

    points: Doubles
    """(M, 3), or (M, 4) with the time."""
    distance: Doubles
    """Value (M,) that the level is to learn there."""
    ratio: float
    """Number of all examples relative to those outside thin features."""


def exact_distances(shape: Shape) -> bool:
    """Whether the shape's distances are exact next to its surface: only a mesh that stands still has exact ones."""
    return not (shape.cloud or shape.moving)


class Miner:
    """Mines the hard examples of one level."""

    def __init__(
        self, shape: Shape, frozen: FrozenLevels, rng: np.random.Generator, config: MiningConfig | None = None
    ) -> None:
        """frozen: the levels before. rng: draws candidates."""
        self._shape, self._frozen, self._rng, self._config = shape, frozen, rng, config or MiningConfig()
        thin = frozen.levels and exact_distances(shape)
        self._thin = ThinFeatures(shape, rng, self._config.thin) if thin else None

    def mine(self, weights: Weights, earlier: Doubles | None, count: int, near: float) -> HardExamples | None:
        """Mine the level with its present `weights`. Returns None where it has (nearly) no hard examples.

        earlier: hard points (K, 3) of the last time; candidates are drawn around them, too. count: most candidates of
        each kind. near: distance from the surface below which f may exceed the distance.
        """
        points, distance = self._off_surface(weights, earlier, count, near)
        others, ratio = max(len(points), self._config.fewest), 1.0
        if self._thin is not None:
            thin, thin_distance = self._thin.mine(partial(self._field, weights), count)
            if len(thin):  # They are few, so each is repeated.
                most = self._config.thin.copies * len(thin)
                drawn = self._rng.integers(len(thin), size=min(most, self._config.thin.ratio * others))
                ratio += len(drawn) / others
                points = np.concatenate((points, thin[drawn]))
                distance = np.concatenate((distance, thin_distance[drawn]))
        if len(points) < self._config.fewest:
            return None
        return HardExamples(points, self._frozen.clip(distance), ratio)

    def around(self, examples: HardExamples | None, vertices: Doubles) -> HardExamples:
        """Add samples around vertices (N, 3) of loose components, with the shape's distances there."""
        config, rng = self._config, self._rng
        if examples is None:
            examples = HardExamples(np.empty((0, 3)), np.empty(0), 0.0)
        others = max(config.fewest, len(examples.points))
        seeds = vertices[rng.integers(len(vertices), size=round(config.component_ratio * others))]
        points = seeds + rng.normal(scale=config.component_spread, size=seeds.shape)
        distance = self._frozen.clip(self._shape.distance(points))
        return HardExamples(
            np.concatenate((examples.points, points)),
            np.concatenate((examples.distance, distance)),
            (1 + config.component_ratio) * max(1.0, examples.ratio),
        )

    def snapshot(self) -> Snapshot:
        """Return the known thin features."""
        return Snapshot() if self._thin is None else Snapshot(tensors={"thin": torch.from_numpy(self._thin.known)})

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from a snapshot. Raises UserError where it is damaged."""
        if self._thin is not None and "thin" in snapshot.tensors:
            self._thin.known = snapshot.rows("thin", 4).numpy()

    def _field(self, weights: Weights, points: Doubles) -> Doubles:
        return self._frozen.field(points, weights)

    def _off_surface(
        self, weights: Weights, earlier: Doubles | None, count: int, near: float
    ) -> tuple[Doubles, Doubles]:
        """Find hard points outside thin features. Returns points (M, 3) and distances (M,)."""
        config, frozen, residual = self._config, self._frozen, bool(self._frozen.levels)
        points = self._candidates(earlier, min(count, config.candidates if residual else config.first_candidates))
        f = self._field(weights, points)
        if residual and self._shape.noise:
            near = np.inf  # Distances to noisy points are too inexact to bound a residual.
        suspected = np.abs(f) > near
        if residual:
            exceeds = np.abs(f) > config.excess * np.abs(frozen.field(points))
            suspected = (suspected & exceeds) | (np.abs(f) < config.near * frozen.delta)
        suspect = self._rng.permutation(np.flatnonzero(suspected))[: config.suspects]
        points, f = points[suspect], f[suspect]
        distance = self._shape.distance(points) if len(points) else np.empty(0)
        size = np.abs(distance)
        hard = (np.abs(f) > config.excess * size) & (size > near)
        if residual:
            lacks = f * np.sign(distance) < losses.LACK * size
            hard |= lacks & (size > config.least_distance * frozen.delta)
            if exact_distances(self._shape):
                hard |= (f * distance < 0) & (size > config.wrong_sign)
        return points[hard], distance[hard]  # A comparison with an unknown distance, NaN, is false.

    def _candidates(self, earlier: Doubles | None, count: int) -> Doubles:
        """Draw points of Omega_{i-1}, some of them around `earlier` hard points. Returns (M, 3)."""
        frozen, rng = self._frozen, self._rng
        seeds = self._shape.surface(count, rng).points
        reach = (2 if frozen.levels else self._config.first_reach) * frozen.delta
        candidates = [sampling.shifted(seeds, rng.uniform(-reach, reach, (len(seeds), 3)))]
        if frozen.levels:
            candidates.insert(0, sampling.timed(sampling.domain(count, rng), self._shape.moving, rng))
        if earlier is not None:
            around = earlier[rng.integers(len(earlier), size=count // 4)]
            spread = rng.normal(scale=self._config.spread * frozen.delta, size=(len(around), 3))
            candidates.append(sampling.shifted(around, spread))
        points = np.concatenate(candidates)
        return points[frozen.in_band(points)]


class ThinFeatures:
    """The thin features of a mesh that its level got wrong at some time."""

    def __init__(self, shape: Shape, rng: np.random.Generator, config: ThinConfig | None = None) -> None:
        """shape: a mesh that stands still. rng: draws candidates."""
        self._shape, self._rng, self._config = shape, rng, config or ThinConfig()
        self.known = np.empty((0, 4), np.float32)
        """Points of these features, with their signed distances: (N, 4)."""

    def mine(self, field: Field, count: int) -> tuple[Doubles, Doubles]:
        """Search for features that `field` has wrong, and return the points in and around known ones where it is wrong.

        Around them, too: an edge that extends beyond its end is as wrong as a lost one. Returns points (M, 3) and the
        values (M,) that the level is to learn there.
        """
        self.search(field, min(2 * count, self._config.candidates))
        config, known = self._config, self.known.astype(np.float64)
        points, distance = known[:, :3], known[:, 3]
        unlearnt = field(points) * np.sign(distance) < config.satisfied * config.margin
        seeds = points
        if len(points):
            seeds = points[self._rng.integers(len(points), size=round(config.around * len(points)))]
        around = seeds + self._rng.normal(scale=config.spread, size=seeds.shape)
        truth = self._shape.distance(around)
        wrong = field(around) * np.sign(truth) < losses.LACK * np.abs(truth)
        wrong &= np.abs(truth) > config.around_least_distance
        taught = np.copysign(np.maximum(np.abs(distance), config.margin), distance)
        return np.concatenate((points[unlearnt], around[wrong])), np.concatenate((taught[unlearnt], truth[wrong]))

    def search(self, field: Field, count: int) -> None:
        """Add the features next to `count` points of the surface that `field` has wrong."""
        config, rng = self._config, self._rng
        drawn = self._shape.surface(count, rng)
        step, side = rng.uniform(config.shortest_step, config.longest_step, count), rng.choice((-1.0, 1.0), count)
        points = drawn.points + (side * step)[:, None] * drawn.normals
        lacks = np.flatnonzero(field(points) * side < losses.LACK * np.minimum(step, config.margin))[: config.suspects]
        points, step, side = points[lacks], step[lacks], side[lacks]
        distance = self._shape.distance(points)
        thin = np.flatnonzero((distance * side > config.least_distance) & (np.abs(distance) < config.nearer * step))
        facing = (self._gradient(points[thin]) * drawn.normals[lacks[thin]]).sum(axis=1) < config.facing
        found = np.column_stack((points, distance))[thin[facing]].astype(np.float32)
        self.known = np.concatenate((self.known, found))

    def _gradient(self, points: Doubles) -> Doubles:
        """Return the gradient (N, 3) of the distance at points (N, 3): the normal of the nearest surface."""
        apart = self._config.gradient_step
        shift = apart / 2 * np.eye(3)[:, None]
        there = np.concatenate((points + shift, points - shift)).reshape(-1, 3)
        ahead, behind = self._shape.distance(there).reshape(2, 3, -1)
        return (ahead - behind).T / apart


def find_strays(shape: Shape, frozen: FrozenLevels, rng: np.random.Generator) -> Doubles:
    """Find points of the band where the frozen levels are wrong by half its width or more. Returns (M, 3) or (M, 4).

    Components of surface may appear there. Dithering around the surface sees such points rarely (inside thin parts) or
    never (far away). The probability of a point is proportional to its squared error.
    """
    config = frozen.config
    if not frozen.levels:
        return np.empty((0, 4 if shape.moving else 3))
    points = sampling.timed(sampling.domain(config.stray_candidates, rng), shape.moving, rng)
    points = points[frozen.in_band(points)][: config.stray_suspects]
    error = np.abs(shape.distance(points) - frozen.field(points))
    wrong = error > config.stray_error * frozen.delta
    points, weight = points[wrong], error[wrong] ** 2
    return rng.choice(points, config.strays, p=weight / weight.sum()) if len(points) else points
