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
