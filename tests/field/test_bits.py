"""Rounded weights compensate one another, and the fewest bits keep the surface."""

import io
import re
from functools import partial

import numpy as np
import pytest
from tqdm import tqdm

from mplicits.bake.registry import TARGETS
from mplicits.codegen.printers.packed import _numbers
from mplicits.codegen.targets import shadertoy
from mplicits.codegen.targets.header import read_header
from mplicits.field import bits, compensated
from mplicits.field.compensated import Samples, Sizes
from mplicits.model import quantize
from mplicits.model.model import Model, Network
from mplicits.model.model_file import load
from support.paths import DEMO
from support.random_model import random_model

SIZES = Sizes(first=127, hidden=9, last=127)


def samples_of(network: Network, seed: int) -> Samples:
    points = np.random.default_rng(seed).uniform(-1, 1, (1500, 3)).astype(np.float32)
    return Samples(points, compensated.output(network, points))


def error_of(network: Network, samples: Samples) -> float:
    return float(np.sqrt(np.square(compensated.output(network, samples.points) - samples.target).mean()))


def test_later_weights_compensate_rounding() -> None:
    """The error on other points is less than half of what the same network has with each weight at its nearest."""
    network = random_model((24, 2)).levels[0].network
    seen, other = samples_of(network, 1), samples_of(network, 2)
    together = compensated.rounded(network, seen, SIZES)
    nearest = tuple(
        type(layer)(
            *(
                (np.rint(array / step) * step).astype(np.float32)
                for array in (layer.weight, layer.bias)
                for step in [float(np.abs(layer.weight).max()) / (9 if 0 < j < len(network) - 1 else 127)]
            )
        )
        for j, layer in enumerate(network)
    )
    assert error_of(together, other) < 0.5 * error_of(nearest, other)
    for j, layer in enumerate(together[:-1]):
        assert quantize.step_of(layer.weight, SIZES.hidden if j else SIZES.first) is not None
    assert compensated.rounded(together, seen, SIZES)[1].weight is not together[1].weight
    for once, twice in zip(together[:-1], compensated.rounded(together, seen, SIZES)[:-1], strict=True):
        np.testing.assert_array_equal(once.weight, twice.weight)


def test_differences_between_neighbors_are_rows() -> None:
    samples = Samples(np.zeros((4, 3), np.float32), np.zeros((4, 1), np.float32), neighbors=1, weight=10.0)
    np.testing.assert_allclose(samples.rows(np.array([1, 2, 1.5, 1], np.float32)), [1, 2, 5, -10])


@pytest.mark.parametrize(("base", "digits"), [(63, 4), (2047, 2)])
def test_numbers_hold_the_weights(base: int, digits: int) -> None:
    half = base // 2
    rows = np.random.default_rng(0).integers(-half, half + 1, (4, 16))
    rows[0], rows[1] = half, -half
    numbers = _numbers(rows, base, digits)
    assert all(0 <= number < 2**31 for number in numbers)
    chunks = np.array(numbers).reshape(-1, 4)
    unpacked = [chunk // base**place % base - half for chunk in chunks for place in range(digits)]
    np.testing.assert_array_equal(np.array(unpacked).T, rows)


@pytest.fixture(scope="module")
def demo() -> tuple[Model, Model]:
    """A trained model, before and after rounding."""
    model = load(DEMO)
    fewest = bits.fewest_bits(model)
    assert fewest is not None
    return model, fewest


@pytest.mark.slow
def test_the_fewest_bits_keep_surface_and_colors(demo: tuple[Model, Model]) -> None:
    model, fewest = demo
    paid = bits.cost(model, fewest)
    assert 0 < paid.distance < 1.2 * max(bits.SHARE * model.levels[-1].delta, bits.LEAST)
    assert 0 < paid.color < 1.2 * 255 * bits.COLOR
    for network in fewest.networks().values():
        assert all(quantize.step_of(layer.weight, bits.HIDDEN[-1]) is not None for layer in network[1:-1])


@pytest.mark.slow
def test_the_header_has_the_rounding_error(demo: tuple[Model, Model], monkeypatch: pytest.MonkeyPatch) -> None:
    model, fewest = demo
    monkeypatch.setattr(shadertoy, "fewest_bits", lambda model: fewest)
    text = shadertoy.baked(model).text
    paid = bits.cost(model, fewest)
    assert read_header(text)["error"]["f"] == pytest.approx(paid.distance, rel=0.06)
    assert len(text) < 0.5 * len(shadertoy.baked(model, "literal").text)
    exact = shadertoy.baked(quantize.quantized_model(random_model((8, 1))), "packed").text
    assert "error" not in read_header(exact)


def test_a_model_without_a_surface_keeps_its_decimals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadertoy, "fewest_bits", lambda model: None)
    assert shadertoy.baked(random_model((8, 1))).text == shadertoy.baked(random_model((8, 1)), "literal").text
    packed = quantize.quantized_model(random_model((8, 1)))
    assert shadertoy.baked(packed).text == shadertoy.baked(packed, "packed").text


def test_a_terminal_names_the_network_being_rounded(monkeypatch: pytest.MonkeyPatch) -> None:
    bars = {}
    monkeypatch.setattr("tqdm.tqdm", partial(tqdm, mininterval=0))  # else a fast machine ends before it is drawn again
    for terminal in (True, False):
        stream = io.StringIO()
        monkeypatch.setattr(stream, "isatty", lambda terminal=terminal: terminal)
        monkeypatch.setattr("sys.stderr", stream)
        assert bits.fewest_bits(random_model((8, 1))) is not None
        bars[terminal] = stream.getvalue()
    assert re.search(r"\rrounding weights, level 1: \|.*\| +[1-9][0-9]*%", bars[True])
    assert bars[True].endswith("\r"), "the bar is wiped"
    assert bars[False] == ""


def test_sizes_are_counted_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadertoy, "fewest_bits", None)
    model = random_model((8, 1))
    assert TARGETS["shadertoy"].size(model) == len(shadertoy.baked(model, "literal").text)
