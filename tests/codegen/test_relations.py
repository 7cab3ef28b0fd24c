"""Changes that leave a field alone: saving, the batching of points, the order and signs of neurons, a rotation."""

import itertools
import math
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mplicits.codegen.targets import glsl330
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model import Layer, Level, Model, Network
from mplicits.model.model_file import load, save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support.fitted_model import fitted_model
from support.random_model import random_model

SIZES = st.tuples(st.integers(1, 12), st.integers(0, 3))
MODELS = st.builds(
    lambda sizes, texture, seed, name: random_model(*sizes, texture=texture, seed=seed, name=name),
    st.lists(SIZES, min_size=1, max_size=3),
    st.none() | SIZES,
    st.integers(0, 2**32 - 1),
    st.sampled_from(["a", "\u00e9\u2028\x00", '"\\*/', "\U0001d6ff" * 300]),
)
FITTED = fitted_model()
QUICK = settings(max_examples=30, deadline=None, database=None, derandomize=True)


def points(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)


def shuffled(network: Network, rng: np.random.Generator) -> Network:
    """Permute the neurons of every hidden layer, and flip the signs of some."""
    layers = list(network)
    for j, (layer, after) in enumerate(itertools.pairwise(network)):
        count = len(layer.bias)
        order, signs = rng.permutation(count), rng.choice(np.array((-1, 1), np.float32), count)
        weight = layers[j].weight
        layers[j] = Layer(weight[order] * signs[:, None], layer.bias[order] * signs)
        layers[j + 1] = Layer(after.weight[:, order] * signs, after.bias)
    return tuple(layers)


def with_shuffled_neurons(model: Model, seed: int) -> Model:
    rng = np.random.default_rng(seed)
    levels = tuple(
        Level(shuffled(level.network, rng), level.delta, level.iterations, level.lipschitz) for level in model.levels
    )
    return Model(model.name, levels, None if model.texture is None else shuffled(model.texture, rng))


@QUICK
@given(MODELS)
def test_save_and_load_are_bit_equal(model: Model) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.safetensors"
        save(model, path)
        again = load(path)
    assert again.sha256() == model.sha256()
    assert (again.name, again.place, again.provenance) == (model.name, model.place, model.provenance)
    for name, tensor in model.tensors().items():
        assert again.tensors()[name].tobytes() == tensor.tobytes()


@QUICK
@given(MODELS, st.integers(0, 200), st.integers(0, 200))
def test_splitting_a_batch_changes_nothing(model: Model, first: int, second: int) -> None:
    program, at, levels = lower(model), points(first + second), len(model.levels)
    parts = [interpret.field(program, part, levels) for part in (at[:first], at[first:])]
    np.testing.assert_allclose(np.concatenate(parts), interpret.field(program, at, levels), rtol=0, atol=1e-6)


@QUICK
@given(MODELS, st.integers(0, 2**32 - 1))
def test_the_order_and_the_signs_of_neurons_change_nothing(model: Model, seed: int) -> None:
    other, levels, at = with_shuffled_neurons(model, seed), len(model.levels), points(100)
    # The rounding error of a sum grows with its terms.
    allowed = 1e-6 * max(1.0, *(float(np.abs(layer.weight).sum(1).max()) for layer in _output_layers(model)))
    f, same = (interpret.field(lower(either), at, levels) for either in (model, other))
    np.testing.assert_allclose(same, f, rtol=0, atol=allowed * 10 * levels)


def _output_layers(model: Model) -> list[Layer]:
    return [level.network[-1] for level in model.levels]


@pytest.mark.parametrize("storage", ["literal", "texture"])
def test_the_order_and_the_signs_of_neurons_change_no_picture(osmesa: Context, storage: str) -> None:
    model = random_model((8, 1), (8, 1), texture=(4, 0))
    pictures = []
    for either in (model, with_shuffled_neurons(model, 1)):
        renderer = Renderer(osmesa, glsl330.bake(either, storage))
        pictures.append(renderer.render((32, 24), Camera(), RenderOptions(shade="data")))
        renderer.release()
    t, same = (picture[..., 0] for picture in pictures)
    hit = (pictures[0][..., 3] == 1) & (pictures[1][..., 3] == 1)
    assert hit.sum() > 20
    assert (pictures[0][..., 3] == pictures[1][..., 3]).mean() > 0.99
    assert np.median(np.abs(t - same)[hit]) < 1e-5


def rotated(model: Model, degrees: float) -> Model:
    """Rotate a model around the y axis, from +z towards +x, like the camera's azimuth."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    back = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])

    def network(layers: Network) -> Network:
        return Layer((layers[0].weight @ back).astype(np.float32), layers[0].bias), *layers[1:]

    levels = tuple(replace(level, network=network(level.network)) for level in model.levels)
    return replace(model, levels=levels, texture=None if model.texture is None else network(model.texture))


@pytest.fixture(scope="module")
def fitted(osmesa: Context) -> Iterator[Renderer]:
    renderer = Renderer(osmesa, glsl330.bake(FITTED, "texture"))
    yield renderer
    renderer.release()


@pytest.mark.slow
@settings(QUICK, max_examples=1)
@given(st.floats(-180, 180), st.floats(-180, 180), st.floats(-80, 80), st.sampled_from(["plain", "relaxed"]))
@example(90.0, 20.0, 15.0, "plain")
@example(1.0, 0.0, 0.0, "relaxed")
def test_model_and_camera_rotated_together_change_no_pixel(
    osmesa: Context, fitted: Renderer, degrees: float, azimuth: float, elevation: float, schedule: str
) -> None:
    """In the plain schedule, no pixel changes by a step of eight bits.

    The relaxed schedule's grid does not rotate with the model, so rays within 1/20 pixel of the silhouette may differ.
    """
    camera, options = Camera(azimuth, elevation), RenderOptions(shade="texture", schedule=schedule)
    here = fitted.render((32, 24), camera, options)
    renderer = Renderer(osmesa, glsl330.bake(rotated(FITTED, degrees), "texture"))
    there = renderer.render((32, 24), camera.orbited(degrees, 0.0), options)
    renderer.release()
    assert 20 < (here[..., 3] == 1).sum() < here[..., 3].size
    different = np.abs(here - there).max(axis=-1)
    assert np.median(different) < 1e-5
    if schedule == "plain":
        assert different.max() < 1 / 255
    else:
        assert (different > 0.05).sum() <= 4
