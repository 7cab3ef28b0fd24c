"""Morphs against closed forms of balls and rods."""

import numpy as np
import pytest
from scipy import ndimage

from mplicits.trainer.shapes import morph
from mplicits.trainer.shapes.morph import Grid, Morph
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints, unit

FRAMES = 30
CELLS = 40
STEP = 2 * morph.EXTENT / CELLS


def places() -> Doubles:
    return morph.vertices_of(CELLS)


def ball(x: float, radius: float) -> Grid:
    return np.asarray(np.linalg.norm(places() - (x, 0, 0), axis=-1) - radius, np.float32)


def rod(start: float, end: float, radius: float) -> Grid:
    """A rod along x with round ends."""
    at = places()
    at[..., 0] -= np.clip(at[..., 0], start, end)
    return np.asarray(np.linalg.norm(at, axis=-1) - radius, np.float32)


def blend(first: Grid, second: Grid) -> Morph:
    times = first / np.where(first == second, 1e-9, first - second)
    return Morph(first, second, times.astype(np.float32))


def pieces(field: Grid) -> int:
    return int(ndimage.label(field < 0, np.ones((3, 3, 3)))[1])


class Ball:
    """A ball off the center."""

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colors: bool = False
    ) -> SurfacePoints:
        normals = unit(rng.normal(size=(count, 3)))
        return SurfacePoints(normals * 0.4 + (0.2, 0, 0), normals)

    def distance(self, points: Doubles) -> Doubles:
        return np.asarray(np.linalg.norm(points - (0.2, 0, 0), axis=1) - 0.4)

    def inputs(self) -> Doubles:
        return self.surface(100, np.random.default_rng(0)).points


def test_grid_distances_match_the_shape() -> None:
    error = np.abs(morph.distances(Ball(), CELLS) - ball(0.2, 0.4))
    assert error[np.abs(ball(0.2, 0.4)) < STEP].max() < 1e-6
    assert error.max() < 1.5 * STEP


def test_a_growing_ball_grows_evenly() -> None:
    change = morph.morph(ball(0.1, 0.3), ball(0.1, 0.7))
    for time in (0.0, 0.25, 0.5, 0.75, 1.0):
        vertices, faces, normals = morph.triangles(change.field(time))
        radii = np.linalg.norm(vertices - (0.1, 0, 0), axis=1)
        assert np.abs(radii - (0.3 + 0.4 * time)).max() < 0.5 * STEP
        assert ((vertices - (0.1, 0, 0)) * normals).sum(axis=1).min() > 0.9 * radii.min(), "outward"
        corners = vertices[faces]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        assert volume == pytest.approx(4 / 3 * np.pi * (0.3 + 0.4 * time) ** 3, rel=0.1)


@pytest.mark.parametrize("backwards", [False, True], ids=["comes", "goes"])
def test_a_thin_limb_grows_and_shrinks_steadily(backwards: bool) -> None:
    shapes = ball(-0.5, 0.35), np.minimum(ball(-0.5, 0.35), rod(-0.5, 0.8, 0.07))
    first, second = shapes[::-1] if backwards else shapes

    def steps(change: Morph) -> Doubles:
        tips = [morph.triangles(change.field(k / FRAMES))[0][:, 0].max() for k in range(FRAMES + 1)]
        assert tips[0] == pytest.approx(0.87 if backwards else -0.15, abs=0.5 * STEP)
        assert tips[-1] == pytest.approx(-0.15 if backwards else 0.87, abs=0.5 * STEP)
        return np.abs(np.diff(tips))

    assert steps(blend(first, second)).max() > 0.3, "the blend alone jumps"
    assert steps(morph.morph(first, second)).max() < 3.5 / FRAMES


def test_a_part_thickest_at_its_far_end_stays_connected() -> None:
    first = ball(-0.6, 0.3)
    second = np.minimum(first, np.minimum(rod(-0.6, 0.6, 0.06), ball(0.6, 0.3)))
    times = np.linspace(0, 1, FRAMES)
    assert max(pieces(blend(first, second).field(time)) for time in times) > 1
    assert max(pieces(morph.morph(first, second).field(time)) for time in times) == 1


def test_a_morph_of_disjoint_shapes_is_never_empty() -> None:
    change = morph.morph(ball(-0.5, 0.3), ball(0.5, 0.3))
    assert all((change.field(time) < 0).any() for time in np.linspace(0, 1, FRAMES))
    assert not (blend(ball(-0.5, 0.3), ball(0.5, 0.3)).field(0.5) < 0).any()
