"""The demo shape: a rope tied into a trefoil knot, of two striped strands and a string of beads.

Formulas give an exact signed distance everywhere. The parts are disjoint solids, so the distance to their union is the
smallest of their distances. The distance to a tube is the distance to its center curve less its radius, also inside,
since the radius is less than the curve's reach. All points are in model space.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .reading_report import ReadingReport
from .shape import Doubles, SurfacePoints, unit

SAMPLES = 8192  # samples of a center curve; between them, its third-order Taylor polynomial is exact to 1e-9
RING, SECTION = 1.0, 0.5  # radii of the torus that the knot lies on
SPREAD, TWIST = 0.185, 9  # distance of the strands from the rope's axis, and their number of turns around it
STRAND = 0.147  # radius of a strand
BEADS, BEAD = 59, 0.147  # number and radius of the beads
NEWTON = 3  # newton steps towards the nearest point of a curve

INK, GOLD, CORAL, CREAM = (np.array(c) / 255 for c in ((16, 74, 104), (238, 182, 62), (214, 69, 65), (250, 236, 214)))


@dataclass(frozen=True, eq=False)
class _Curve:
    """A closed curve, sampled at t_i = 2 pi i / SAMPLES."""

    derivatives: Doubles
    """(4, SAMPLES, 3): the points, and the derivatives of first to third order."""
    outward: Doubles
    """(SAMPLES, 3): unit vectors away from the rope's axis."""
    tree: cKDTree
    """Of the points."""


@dataclass(frozen=True, eq=False)
class _Rope:
    """The parts of the shape."""

    tubes: tuple[_Curve, ...]
    """Center curves of the strands."""
    beads: cKDTree
    """Centers of the beads."""
    radius: float
    """Radius of the tubes."""
    bead_radius: float


class DemoShape:
    """The demo shape as a `Shape`."""

    name = "demo"
    center = (0.0, 0.0, 0.0)
    scale = 1.0
    noise = 0.0
    cloud = False
    moving = False
    taken: ReadingReport | None = None
    colored = True

    def __init__(self) -> None:
        self.source: dict[str, Any] = {"file": "demo", "sha256": None}

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw `count` points uniformly by area, with exact normals."""
        rope = _rope()
        # The area of a tube around a closed curve is its length times its circumference (Pappus).
        areas = [2 * np.pi * rope.radius * _speed(curve).mean() * 2 * np.pi for curve in rope.tubes]
        areas.append(4 * np.pi * rope.bead_radius**2 * rope.beads.n)
        counts = rng.multinomial(count, np.array(areas) / sum(areas))
        parts = [_sample_tube(curve, rope.radius, n, rng) for curve, n in zip(rope.tubes, counts[:-1], strict=True)]
        normals = unit(rng.normal(size=(counts[-1], 3)))
        centers = rope.beads.data[rng.integers(rope.beads.n, size=counts[-1])]
        parts.append((centers + rope.bead_radius * normals, normals))
        order = rng.permutation(count)
        points, normals = (np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True))
        return SurfacePoints(points, normals, self.colors_near(points) if colors else None)

    def colors_near(self, points: Doubles) -> Doubles:
        """Compute the colors (N, 3), sRGB in [0, 1], at points (N, 3) on or near the surface."""
        rope = _rope()
        near = [_nearest(curve, points) for curve in rope.tubes]
        distances = [np.linalg.norm(points - foot, axis=1) - rope.radius for foot, _, _ in near]
        to_bead, bead = (np.asarray(column) for column in rope.beads.query(points, workers=-1))
        part = np.argmin([*distances, to_bead - rope.bead_radius], axis=0)
        colors = np.where((bead % 3 == 0)[:, None], GOLD, CREAM)
        for k, (foot, t, index) in enumerate(near):
            mine = part == k
            colors[mine] = _stripes(k, points[mine] - foot[mine], t[mine], rope.tubes[k], index[mine])
        return colors

    def inputs(self) -> Doubles:
        """Return a dense sample of the surface (100000, 3), in place of a file's points."""
        return self.surface(100_000, np.random.default_rng(0)).points

    def distance(self, points: Doubles) -> Doubles:
        """Compute the exact signed distance (N,) at points (N, 3)."""
        rope = _rope()
        tubes = [np.linalg.norm(points - _nearest(curve, points)[0], axis=1) - rope.radius for curve in rope.tubes]
        beads = rope.beads.query(points, workers=-1)[0] - rope.bead_radius
        return np.asarray(np.min([*tubes, beads], axis=0))


@cache
def _rope() -> _Rope:
    """Build the parts, normalized to model space."""
    t = np.linspace(0, 2 * np.pi, SAMPLES, endpoint=False, dtype=np.float64)
    ring = RING + SECTION * np.cos(3 * t)
    axis = np.stack((ring * np.cos(2 * t), ring * np.sin(2 * t), SECTION * np.sin(3 * t)), axis=1)  # (2, 3) torus knot
    around = np.stack((np.cos(3 * t) * np.cos(2 * t), np.cos(3 * t) * np.sin(2 * t), np.sin(3 * t)), axis=1)
    across = np.cross(unit(_derivative(axis)), around)
    angles = [TWIST * t + 2 * np.pi * k / 3 for k in range(3)]
    outward = [np.cos(a)[:, None] * around + np.sin(a)[:, None] * across for a in angles]
    strands = [axis + SPREAD * out for out in outward]
    beads = _evenly(strands[2], BEADS)
    # Parts are swept balls: add the radius to the box and the largest norm of the centers.
    everything = np.concatenate((*strands[:2], beads))
    radii = np.repeat((STRAND, BEAD), (2 * SAMPLES, BEADS))[:, None]
    center = ((everything - radii).min(axis=0) + (everything + radii).max(axis=0)) / 2
    scale = (np.linalg.norm(everything - center, axis=1) + radii[:, 0]).max()
    tubes = tuple(_curve((s - center) / scale, out) for s, out in zip(strands[:2], outward[:2], strict=True))
    return _Rope(tubes, cKDTree((beads - center) / scale), STRAND / scale, BEAD / scale)


def _derivative(curve: Doubles) -> Doubles:
    """Differentiate a closed curve (SAMPLES, 3) by its parameter, spectrally."""
    frequencies = np.arange(SAMPLES // 2 + 1) * 1j
    return np.fft.irfft(np.fft.rfft(curve, axis=0) * frequencies[:, None], SAMPLES, axis=0)


def _curve(points: Doubles, outward: Doubles) -> _Curve:
    derivatives = [points]
    for _ in range(3):
        derivatives.append(_derivative(derivatives[-1]))
    return _Curve(np.stack(derivatives), outward, cKDTree(points))


def _speed(curve: _Curve) -> Doubles:
    return np.asarray(np.linalg.norm(curve.derivatives[1], axis=1))


def _evenly(curve: Doubles, count: int) -> Doubles:
    """Place points (count, 3) on a closed curve (N, 3) at equal arc lengths."""
    closed = np.concatenate((curve, curve[:1]))
    lengths = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))))
    at = np.arange(count) * lengths[-1] / count
    return np.stack([np.interp(at, lengths, closed[:, k]) for k in range(3)], axis=1)


def _taylor(curve: _Curve, index: NDArray[np.int64], h: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Evaluate the curve, its first and its second derivative, (N, 3) each, at t_index + h. index, h: (N,)."""
    p, d1, d2, d3 = curve.derivatives[:, index]
    h = h[:, None]
    return p + h * (d1 + h / 2 * (d2 + h / 3 * d3)), d1 + h * (d2 + h / 2 * d3), d2 + h * d3


def _nearest(curve: _Curve, points: Doubles) -> tuple[Doubles, Doubles, NDArray[np.int64]]:
    """Find the curve points nearest to points (N, 3), by Newton's method from the nearest samples.

    Returns the curve points (N, 3), their parameters t (N,), and the indices (N,) of the nearest samples.
    """
    index = np.asarray(curve.tree.query(points, workers=-1)[1], dtype=np.int64)
    step = 2 * np.pi / SAMPLES
    h = np.zeros(len(points))
    for _ in range(NEWTON):
        foot, d1, d2 = _taylor(curve, index, h)
        away = foot - points
        bend = np.einsum("ij,ij->i", d1, d1) + np.einsum("ij,ij->i", away, d2)
        h = np.clip(h - np.einsum("ij,ij->i", away, d1) / np.maximum(bend, 1e-9), -step, step)
    return _taylor(curve, index, h)[0], index * step + h, index


def _sample_tube(curve: _Curve, radius: float, count: int, rng: Generator) -> tuple[Doubles, Doubles]:
    """Draw points and normals of a tube around the curve, (count, 3) each, uniformly by area, by rejection.

    The area element at t and angle is radius |c'| (1 - radius <curvature, normal>).
    """
    speed = _speed(curve)
    tangent = curve.derivatives[1] / speed[:, None]
    bend = curve.derivatives[2] - np.einsum("ij,ij->i", curve.derivatives[2], tangent)[:, None] * tangent
    curvature = bend / speed[:, None] ** 2
    most = (speed * (1 + radius * np.linalg.norm(curvature, axis=1))).max()
    points, normals, missing = [], [], count
    while missing:
        index = rng.integers(SAMPLES, size=2 * missing + 16)
        h = (rng.random(len(index)) - 0.5) * (2 * np.pi / SAMPLES)
        center, d1, _ = _taylor(curve, index, h)
        side, up = _frame(curve, index, d1)
        angle = rng.random(len(index)) * 2 * np.pi
        normal = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up
        element = speed[index] * (1 - radius * np.einsum("ij,ij->i", curvature[index], normal))
        kept = np.flatnonzero(rng.random(len(index)) * most < element)[:missing]
        points.append(center[kept] + radius * normal[kept])
        normals.append(normal[kept])
        missing -= len(kept)
    return np.concatenate(points), np.concatenate(normals)


def _frame(curve: _Curve, index: NDArray[np.int64], tangent: Doubles) -> tuple[Doubles, Doubles]:
    """Return two unit vectors (N, 3) across the curve at samples (N,); the first points away from the rope's axis."""
    along = unit(tangent)
    side = unit(curve.outward[index] - np.einsum("ij,ij->i", curve.outward[index], along)[:, None] * along)
    return side, np.cross(along, side)


def _stripes(strand: int, away: Doubles, t: Doubles, curve: _Curve, index: NDArray[np.int64]) -> Doubles:
    """Compute the colors (N, 3) of spiral stripes on a tube.

    strand: 0 or 1. away: (N, 3), from the center curve to the points. t: (N,), parameters of the nearest points of the
    curve. index: (N,), of the nearest samples.
    """
    side, up = _frame(curve, index, curve.derivatives[1][index])
    angle = np.arctan2(np.einsum("ij,ij->i", away, up), np.einsum("ij,ij->i", away, side))
    ground, stripe, turns = ((INK, GOLD, 24), (CORAL, CREAM, -36))[strand]
    wave = np.clip((np.sin(turns * t + 2 * angle) - 0.1) / 0.7, 0, 1)[:, None]
    mix = wave * wave * (3 - 2 * wave)  # smoothstep
    return np.asarray(ground * (1 - mix) + stripe * mix)
