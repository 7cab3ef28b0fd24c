"""Shapes with known normals or sharp edges, for benchmarks/grain.py: sphere, torus, cube, gear, and a rounded wedge."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
TORUS = 0.7, 0.3
"""Radii of the torus: of its center line, and of its tube."""
TEETH, ROOT, HUB, BORE = 16, 0.78, 0.45, 0.22
"""Number of the gear's teeth, and radii relative to that of the teeth's tips."""
PITCH = 2 * np.pi / TEETH
TOOTH = (0.0, 0.09, 0.18, 0.36, 0.52, 0.68, 0.84)
"""Angles of the stations of a tooth, in pitches: the tip's start, middle and end, then the root's."""
TALL, THIN = 0.3, 0.16
"""Half the height of the gear's hub, and of its disk."""
KEYWAY = 0.03, 0.3, 2.6
"""Half the width of the groove in the gear's bore, the radius of its bottom, and its angle in pitches."""
WEDGE = ((0.9, -0.55, 0.0), (0.9, 0.2, 0.25), (0.1, 0.75, 0.0), (-0.5, 0.6, 0.3), (-0.95, -0.1, 0.0), (-0.4, -0.6, 0.2))
"""Corners of the wedge's outline (x, y), and the radius of each one's fillet; 0: the edge is sharp."""
RINGS = 14
"""Rings of faces in each of the wedge's caps."""


@dataclass(frozen=True)
class Solid:
    """A mesh, and the smooth surface that it stands for."""

    mesh: trimesh.Trimesh
    exact: Callable[[Doubles], Doubles] | None = None
    """Unit normals (N, 3) of that surface at points (N, 3); None: those of the curved mesh."""


def sphere() -> Solid:
    """Return the unit sphere."""
    return Solid(trimesh.creation.icosphere(subdivisions=5), lambda points: points / _length(points))


def torus() -> Solid:
    """Return a torus around the z axis."""
    far, near = TORUS

    def normals(points: Doubles) -> Doubles:
        flat = points * (1, 1, 0)
        outward = points - flat / _length(flat) * far
        return np.asarray(outward / _length(outward))

    return Solid(trimesh.creation.torus(far, near, major_sections=192, minor_sections=96), normals)


def cube() -> Solid:
    """Return a cube of twelve triangles."""
    return Solid(trimesh.creation.box((1, 1, 1)))


def gear() -> Solid:
    """Return a gear with a hub, and a groove in its bore: the outline of a half plane, turned around the z axis."""
    half, deep, middle = KEYWAY
    wall, corner = (float(np.arcsin(half / radius) / PITCH) for radius in (BORE, deep))
    groove = np.array((-wall, -corner, 0, corner, wall)) + middle
    teeth = (np.arange(TEETH)[:, None] + np.array(TOOTH)).ravel()
    shares = np.sort(np.concatenate((teeth, groove)))
    tips = np.interp(shares % 1, (TOOTH[2], TOOTH[3], TOOTH[-1], 1), (1, ROOT, ROOT, 1))
    bores = np.interp(shares, groove, (BORE, deep, deep, deep, BORE))
    rows = []
    for angle, tip, bore in zip(shares * PITCH, tips, bores, strict=True):
        outline = [(bore, -TALL), (HUB, -TALL), (HUB, -THIN), (tip, -THIN)]
        outline += [(radius, -height) for radius, height in reversed(outline)]
        rows.append([(radius * np.cos(angle), radius * np.sin(angle), height) for radius, height in outline])
    return Solid(_loft(np.array(rows), closed=True))


def wedge() -> Solid:
    """Return a solid with flat, cylindrical and saddle-shaped faces, sharp and rounded edges, like the fandisk."""
    outline = _filleted(WEDGE)
    scales = np.linspace(0, 1, RINGS + 1)[1:]
    rows = []
    for x, y in outline:
        below = [(s * x, s * y, -0.35) for s in scales]
        above = [(s * x, s * y, _top(s * x, s * y)) for s in scales[::-1]]
        rows.append(below + above)
    solid = _loft(np.array(rows), closed=False)
    count, last = len(solid.vertices), 2 * RINGS - 1
    starts = np.arange(len(rows)) * (last + 1)
    ends = np.roll(starts, -1)
    caps = [(count, b, a) for a, b in zip(starts, ends, strict=True)]
    caps += [(count + 1, a, b) for a, b in zip(starts + last, ends + last, strict=True)]
    vertices = np.concatenate((solid.vertices, [(0, 0, -0.35), (0, 0, _top(0, 0))]))
    faces = np.concatenate((solid.faces, np.array(caps, np.int64)))
    return Solid(trimesh.Trimesh(vertices, faces, process=False))


SOLIDS: dict[str, Callable[[], Solid]] = {"sphere": sphere, "torus": torus, "cube": cube, "gear": gear, "wedge": wedge}
SHARP = ("cube", "gear", "wedge")
"""The shapes that have creases."""


def _top(x: float, y: float) -> float:
    return float(0.3 + 0.18 * np.cos(1.4 * x) - 0.12 * y * y)


def _filleted(corners: tuple[tuple[float, float, float], ...], spacing: float = 0.06) -> Doubles:
    """Return points (N, 2) along a polygon with rounded corners. corners: (x, y, radius), counterclockwise."""
    places = np.array(corners)[:, :2]
    stops: list[Doubles] = []
    for i, (_, _, radius) in enumerate(corners):
        here, back, forth = places[i], places[i - 1] - places[i], places[(i + 1) % len(places)] - places[i]
        back, forth = back / np.linalg.norm(back), forth / np.linalg.norm(forth)
        half = np.arccos(back @ forth) / 2
        bisector = (back + forth) / np.linalg.norm(back + forth)
        center = here + bisector * radius / np.sin(half)
        turn = np.linspace(-1, 1, 9) * (np.pi / 2 - half)
        side = np.array((-bisector[1], bisector[0]))
        arc = [center - radius * (np.cos(angle) * bisector + np.sin(angle) * side) for angle in turn]
        arc = arc if np.dot(arc[0] - here, back) > np.dot(arc[-1] - here, back) else arc[::-1]
        stops += arc if radius else [here]
    points = []
    for here, there in zip(stops, [*stops[1:], stops[0]], strict=True):
        count = max(1, int(np.linalg.norm(there - here) / spacing))
        points += [here + (there - here) * k / count for k in range(count)]
    return np.array(points)


def _loft(rows: Doubles, *, closed: bool) -> trimesh.Trimesh:
    """Join lines of points (N, M, 3) by triangles, the last line to the first. closed: each line's ends are joined."""
    count, size = rows.shape[:2]
    here = np.arange(count)[:, None] * size + np.arange(size)
    beside, width = np.roll(here, -1, axis=0), size if closed else size - 1
    a, b = here[:, :width], np.roll(here, -1, axis=1)[:, :width]
    c, d = beside[:, :width], np.roll(beside, -1, axis=1)[:, :width]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    mesh = trimesh.Trimesh(rows.reshape(-1, 3), faces, process=False)
    if closed and mesh.volume < 0:
        mesh.invert()
    return mesh


def _length(vectors: Doubles) -> Doubles:
    return np.asarray(np.linalg.norm(vectors, axis=1, keepdims=True))
