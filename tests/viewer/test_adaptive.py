"""Adaptive sampling: which pixels get further samples, their packing, and the quality of the picture."""

from dataclasses import replace

import numpy as np
import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.samples import PLENTY, SHARE
from mplicits.model.gallery import model_path
from mplicits.model.model import Layer, Level, Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.adaptive import (
    add_samples,
    first_offset,
    from_blocks,
    into_blocks,
    sample_counts,
    sample_points,
)
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.supersampling import jitters

SIZE = 100, 90
SIXTEEN = RenderOptions(samples=16)
RADIUS = 0.7
"""Of `sphere`, model units."""


@pytest.fixture(scope="module")
def renderer(osmesa: Context) -> Renderer:
    return Renderer(osmesa, bake(load(model_path("spot-small")), "texture", passes=True))


def sphere() -> Model:
    """Return a sphere of `RADIUS`: its field is (x^2 + y^2 + z^2) / (2 RADIUS) - RADIUS / 2, from cosines."""
    steep = 0.1  # 2 (1 - cos(steep x)) / steep^2 is nearly x^2
    factor = 1 / steep**2 / RADIUS
    hidden = Layer(np.eye(3, dtype=np.float32) * np.float32(steep), np.full(3, np.pi / 2, np.float32))
    last = Layer(np.full((1, 3), -factor, np.float32), np.array([3 * factor - RADIUS / 2], np.float32))
    return Model("sphere", (Level((hidden, last), 0.1, 60, step_bound=0.7),))


def disc(pixels: float, finer: int = 16) -> np.ndarray:
    """Return the share of each pixel of a picture of `SIZE` that a disc of this area at its center covers."""
    y, x = ((np.arange(finer * side) + 0.5) / finer - side / 2 for side in SIZE[::-1])
    inside = x**2 + y[:, None] ** 2 < pixels / np.pi
    return np.asarray(inside.reshape(SIZE[1], finer, SIZE[0], finer).mean(axis=(1, 3)))


def decibels(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(-10 * np.log10(((picture - truth) ** 2).mean()))


def test_only_pixels_beside_an_edge_get_further_samples() -> None:
    picture = np.full((20, 30, 4), 0.5, np.float32)
    picture[:, 12:, 1] = 0.7
    picture[:, :, 0] += np.linspace(0, 0.1, 30)  # a slope is no edge
    counts = sample_counts(picture, 16)
    assert (np.flatnonzero(counts.any(axis=0)) == [11, 12]).all()
    assert (counts[:, 11:13] >= 12).all()


@pytest.mark.parametrize("samples", [1, 3, 4, 16])
def test_samples_keep_to_their_share(samples: int) -> None:
    noise = np.random.default_rng(0).random((40, 50, 4)).astype(np.float32)
    share = SHARE * (samples - 1)
    assert 0.8 * share <= sample_counts(0.02 * noise, samples).mean() <= share
    assert 2 * share <= sample_counts(noise, samples).mean() <= (PLENTY**2 * share) ** (1 / 3)
    noise[..., 3] = 0.0
    assert not sample_counts(noise, samples).any()


@pytest.mark.parametrize("count", [1, 15, 16, 17, 1000, 4096])
def test_blocks_keep_samples_close_together_and_in_order(count: int) -> None:
    values = np.arange(2 * count, dtype=np.float32).reshape(count, 2)
    image = into_blocks(values, 64)
    assert image.shape[0] % 4 == image.shape[1] % 4 == 0
    assert image.shape[1] <= 64
    assert np.ptp(image[:4, :4, 0]) <= 30
    np.testing.assert_array_equal(from_blocks(image, count), values)


def test_points_are_spread_around_the_pixel_centers() -> None:
    counts = np.zeros((3, 4), np.int64)
    counts[1, 3], counts[2, 1] = 3, 2
    points, pixels = sample_points(counts, (10, 20))
    assert pixels.tolist() == [7, 7, 7, 9, 9]
    np.testing.assert_allclose(points[:3] - jitters(3), [[13.5, 21.5]] * 3, atol=1e-5)
    np.testing.assert_allclose(points[3:] - jitters(2), [[11.5, 22.5]] * 2, atol=1e-5)
    sums = np.zeros((3, 4, 2), np.float32)
    add_samples(sums, pixels, np.array([[1, 10], [2, 20], [4, 40], [8, 0], [16, 0]], np.float32))
    assert sums[1, 3].tolist() == [7, 70]
    assert sums[2, 1].tolist() == [24, 0]
    assert sums.sum() == 101


def test_two_samples_lie_on_opposite_sides_of_the_center() -> None:
    second, _ = sample_points(np.ones((1, 1), np.int64))
    np.testing.assert_allclose(first_offset(2) + second - 0.5, 0, atol=1e-6)
    assert np.abs(first_offset(2)).min() > 0.2
    for samples in (1, 3, 16):
        np.testing.assert_array_equal(first_offset(samples), 0)


def test_scattered_samples_equal_those_of_a_tile(renderer: Renderer) -> None:
    """Bit by bit: the same rays, drawn in another order."""
    offset = jitters(3)[1]
    single = replace(SIXTEEN, samples=1)
    with renderer.context:
        renderer.prepare(SIZE, Camera(), single, (float(offset[0]), float(offset[1])))
        target = renderer.context.gl.framebuffer(
            [renderer.context.gl.texture(SIZE, 4, dtype="f4")], renderer.context.gl.depth_renderbuffer(SIZE)
        )
        renderer.draw(target, (0, 0, *SIZE))
        tile = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(SIZE[1], SIZE[0], 4)
        renderer.prepare(SIZE, Camera(), single)
        pixels = np.random.default_rng(0).random(tile.shape[:2]) < 0.2
        scattered = renderer.samples_at(sample_points(np.where(pixels, 3, 0))[0])
    np.testing.assert_array_equal(scattered[1::3], tile[pixels])


@pytest.mark.parametrize("options", [SIXTEEN, replace(SIXTEEN, transparent=True)])
def test_adaptive_sampling_beats_four_samples_everywhere_with_fewer(renderer: Renderer, options: RenderOptions) -> None:
    everywhere = renderer.render(SIZE, Camera(), replace(options, uniform=True))
    adaptive = renderer.render(SIZE, Camera(), options)
    four = renderer.render(SIZE, Camera(), replace(options, uniform=True, samples=4))
    assert decibels(adaptive, everywhere) > decibels(four, everywhere)
    once = renderer.render(SIZE, Camera(), replace(options, samples=1))
    assert sample_counts(once, 16).sum() <= 3 * (once[..., 3] > 0).sum(), "and one of each pixel: 4 of the shape's"


def test_the_edge_of_a_sphere_gets_smoother_with_every_sample(osmesa: Context) -> None:
    renderer, errors, drawn = Renderer(osmesa, bake(sphere(), "texture", passes=True)), [], []
    everywhere = renderer.render(SIZE, Camera(), RenderOptions(samples=64, uniform=True))
    truth = disc(everywhere[..., 3].sum())  # rays hit within half a pixel: a little wider than the sphere
    for samples in (1, 2, 3, 4, 5, 16):
        before = renderer.drawn
        picture = renderer.render(SIZE, Camera(), RenderOptions(samples=samples))
        errors.append(float(np.sqrt(((picture[..., 3] - truth) ** 2).mean())))
        drawn.append((renderer.drawn - before) / truth.size - 1)
    renderer.release()
    assert np.all(np.diff(np.log(errors)) < np.log(0.9)), errors
    assert drawn[0] == 0
    assert np.all(np.diff(drawn) > 0)
    assert np.all(drawn <= 0.25 * np.array([0, 1, 2, 3, 4, 15]) * truth.mean())
