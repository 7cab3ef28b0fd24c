"""The page's texts for other programs are Python's: quantized weights, Shadertoy's text, and the GLSL function.

The scripts run in one blank page in Chromium, without drawing.
"""

import base64
import dataclasses
import json
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import shadertoy, shadertoy_text
from mplicits.codegen.targets.glsl300es import DIALECT
from mplicits.codegen.targets.header import read_header
from mplicits.codegen.targets.shadertoy_text import Savings
from mplicits.field.bits import COLOR, LEAST, SHARE, cost
from mplicits.field.digits import fewest_digits
from mplicits.field.lowest import lowest_point
from mplicits.ir.lower import lower
from mplicits.model import quantize
from mplicits.model.gallery import FOLDER
from mplicits.model.model import Layer, Model, Network
from mplicits.model.model_file import load, to_bytes
from mplicits.model.version import installed_version
from mplicits.trainer.networks.network import from_model, to_model
from mplicits.trainer.networks.quantized import quantized_step
from mplicits.viewer.draw.context import Context
from mplicits.web.bundle import modules, script
from mplicits.web.facts import facts_json
from mplicits.web.page import text_facts
from support.fitted_model import fitted_model
from support.paths import DEMO
from support.random_model import random_model, random_network
from support.shadertoy import picture

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ASK = """
const bufferOf = (bytes) => Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0)).buffer;
const modelOf = (bytes, ground) => ({...parseModel(bufferOf(bytes)), ground});
const plain = (network) => network.map(({weight, bias}) => [Array.from(weight), Array.from(bias)]);
window.ask = {
    quantized: ([bytes, again]) => {
        const {network} = modelOf(bytes).levels[0];
        const result = quantized(network);
        if (again) quantizedNetwork(network, network);
        return {known: isQuantized(network), then: isQuantized(result), network: plain(again ? network : result)};
    },
    clamped: (bytes) => {
        const {network} = modelOf(bytes).levels[0];
        clampToQuantized(network, quantized(network));
        return plain(network);
    },
    digits: ([values, digits]) => values.map((value) => withDigits(value, digits)),
    json: (value) => pythonJson(value),
    hash: (bytes) => hashOf(bufferOf(bytes)),
    shadertoy: async ([bytes, ground, shade]) => (
        shadertoyText(modelOf(bytes, ground), await hashOf(bufferOf(bytes)), shade)),
    rounded: async (bytes) => {
        const {model: {levels, texture}, error} = await fewestBits(modelOf(bytes));
        return {networks: [...levels.map(({network}) => network), ...(texture ? [texture] : [])].map(plain), error};
    },
    glsl: async (bytes) => functionText(modelOf(bytes), await hashOf(bufferOf(bytes))),
};
null;
"""
Ask = Callable[[str, Any], Any]


def encoded(model: Model) -> str:
    """Return a model's file in base64."""
    return base64.b64encode(to_bytes(model)).decode()


@pytest.fixture(scope="module")
def ask(browser: "Browser", tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ask]:
    """Return a function that calls a function of ASK with an argument."""
    path, page = tmp_path_factory.mktemp("page") / "page.html", browser.new_page()
    facts = facts_json({"mplicits": installed_version()} | text_facts())
    prologue = f'<script type="x-shader/x-fragment" id="prologue">{DIALECT.helpers}</script>'
    template = f'<script type="x-shader/x-fragment" id="shadertoy.glsl">{shadertoy_text.main_template()}</script>'
    path.write_text(f'<script type="application/json" id="facts">{facts}</script>{prologue}{template}')
    page.goto(path.as_uri())
    page.evaluate(script(modules("safetensors.js", "field.js", "shadertoy.js", "glsl_function.js")) + ASK)
    yield lambda name, value: page.evaluate("([name, value]) => window.ask[name](value)", [name, value])
    page.close()


@pytest.fixture
def without_savings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadertoy_text, "savings", lambda _program, _length: Savings())


def as_network(layers: list[list[list[float]]], network: Network) -> Network:
    """Return a network of the page in the shapes of another."""
    arrays = [[np.array(values, np.float32) for values in layer] for layer in layers]
    return tuple(
        Layer(weight.reshape(old.weight.shape), bias) for (weight, bias), old in zip(arrays, network, strict=True)
    )


def assert_same(ours: Network, theirs: Network) -> None:
    """Compare all bits, signs of zeros included."""
    for a, b in zip(ours, theirs, strict=True):
        assert a.weight.tobytes() == b.weight.tobytes()
        assert a.bias.tobytes() == b.bias.tobytes()


def networks_of(model: Model) -> list[Network]:
    return list(model.networks().values())


NETWORKS = {
    **{
        f"{width}x{depth}": random_network(width, depth, np.random.default_rng(width))
        for width, depth in [(5, 1), (20, 2), (48, 3)]
    },
    "demo": load(DEMO).levels[1].network,
    "bob": load(FOLDER / "bob.safetensors").levels[1].network,
    "bob-small": load(FOLDER / "bob-small.safetensors").levels[1].network,
    "zeros": (
        Layer(np.zeros((4, 3), np.float32), np.full(4, -0.0, np.float32)),
        *random_network(4, 1, np.random.default_rng(0))[1:],
    ),
}


def one_level(network: Network) -> Model:
    model = random_model((4, 0))
    return dataclasses.replace(model, levels=(dataclasses.replace(model.levels[0], network=network),))


@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
@pytest.mark.parametrize("again", [False, True], ids=["copy", "in place"])
def test_the_page_quantizes_as_python(ask: Ask, network: Network, again: bool) -> None:
    found, expected = ask("quantized", [encoded(one_level(network)), again]), quantize.quantized(network)
    assert_same(as_network(found["network"], network), expected)
    assert found["then"]
    assert found["known"] == (again or quantize.is_quantized(network))


def test_the_page_clamps_as_the_training(ask: Ask) -> None:
    network = random_network(20, 2, np.random.default_rng(2))
    network[1].weight[3, 5] = 7.0
    clamped = as_network(ask("clamped", encoded(one_level(network))), network)
    weights = from_model(network)
    quantized_step(lambda _weights: 0.0)(weights)
    for ours, theirs in zip(clamped, to_model(weights), strict=True):
        np.testing.assert_array_equal(ours.weight, theirs.weight)
    assert clamped[1].weight.max() < 1


def test_numbers_and_json_are_python_s(ask: Ask) -> None:
    rng = np.random.default_rng(0)
    values = [
        *(rng.uniform(-1, 1, 500) * 10.0 ** rng.integers(-12, 12, 500)).tolist(),
        1.125,
        1.135,
        2.5,
        0.0625,
        12.25,
    ]
    for digits in (2, 3, 6):
        assert ask("digits", [values, digits]) == [float(f"{value:.{digits}g}") for value in values]
    fractional = [*values, 1e16, 1e22, 1e-5, 0.0001, 3.0]
    text = {"a": '\x7f"\\\n\x01é😀</script>', "b": fractional, "c": []}
    assert ask("json", text) == json.dumps(text)


@pytest.mark.parametrize("name", ["spot-small", "bob", "spot-to-bob"])
def test_the_page_hashes_as_python(ask: Ask, name: str) -> None:
    model = load(FOLDER / f"{name}.safetensors")
    assert ask("hash", encoded(model)) == model.sha256()


PACKED = {
    "spot-small": load(FOLDER / "spot-small.safetensors"),
    "bob-small": load(FOLDER / "bob-small.safetensors"),
    "one level": quantize.quantized_model(random_model((12, 3), name="</script> é")),
    "three levels, texture": quantize.quantized_model(random_model((16, 1), (18, 0), (40, 2), texture=(10, 1))),
}


@pytest.mark.usefixtures("without_savings")
@pytest.mark.parametrize("model", PACKED.values(), ids=PACKED)
@pytest.mark.parametrize("shade", [None, "softbox", "phong"])
def test_quantized_models_have_python_s_text(ask: Ask, model: Model, shade: str | None) -> None:
    text = ask("shadertoy", [encoded(model), lowest_point(lower(model)), shade])
    assert text == shadertoy.baked(model, "packed", shade=shade).text


@pytest.mark.usefixtures("without_savings")
@pytest.mark.parametrize(
    "model",
    [load(FOLDER / "spot-to-bob.safetensors"), random_model((6, 1), inputs="xyzt")],
    ids=["spot-to-bob", "random"],
)
def test_moving_models_have_python_s_text(ask: Ask, model: Model) -> None:
    program = lower(model, fewest_digits(model))
    text = ask("shadertoy", [encoded(model), lowest_point(program), None])
    assert text == shadertoy.baked(model, "literal").text


ROUNDED = {
    "fitted": fitted_model((24, 64)),
    "bob": load(FOLDER / "bob.safetensors"),
    "one level quantized": dataclasses.replace(
        load(FOLDER / "spot-small.safetensors"), texture=load(FOLDER / "spot.safetensors").texture
    ),
}

LONGEST = {"bob": 55_964}
"""Characters of Python's text, whose search takes half a minute."""


def rounded_by(ask: Ask, model: Model) -> tuple[Model, dict[str, float]]:
    """Return the model that the page rounds, and the error that it finds."""
    found = ask("rounded", encoded(model))
    networks = [as_network(layers, old) for layers, old in zip(found["networks"], networks_of(model), strict=True)]
    pairs = zip(model.levels, networks, strict=False)
    levels = tuple(dataclasses.replace(level, network=network) for level, network in pairs)
    return dataclasses.replace(model, levels=levels, texture=networks[-1]), found["error"]


@pytest.mark.parametrize("model", ROUNDED.values(), ids=ROUNDED)
def test_other_models_are_rounded_within_the_limits(ask: Ask, model: Model) -> None:
    """The header states the error."""
    rounded, error = rounded_by(ask, model)
    paid = cost(model, rounded)
    for key, value in {"f": paid.distance, "degrees": paid.angle, "colour": paid.color}.items():
        assert error[key] == pytest.approx(value, rel=0.2, abs=0.02 if key == "degrees" else 1e-6)
    assert paid.distance < 1.2 * max(SHARE * model.levels[-1].delta, LEAST)
    assert paid.angle < 1.2 * 0.7
    assert paid.color < 1.2 * 255 * COLOR
    text = ask("shadertoy", [encoded(model), -1, None])
    assert read_header(text)["error"] == {key: float(f"{value:.2g}") for key, value in error.items()}
    assert len(text) < 1.35 * LONGEST.get(model.name, np.inf)


@pytest.mark.usefixtures("without_savings")
def test_the_text_draws_the_rounded_model(ask: Ask, osmesa: Context) -> None:
    """Python's text of decimals draws the renderer's picture (tests/codegen/test_shadertoy.py)."""
    model = ROUNDED["fitted"]
    rounded, _ = rounded_by(ask, model)
    text = ask("shadertoy", [encoded(model), -1, "phong"])
    expected = picture(osmesa, shadertoy.baked(rounded, "literal", digits=7, shade="phong").text)
    error = np.square((picture(osmesa, text) - expected).astype(float)).mean()
    assert 10 * np.log10(255**2 / error) > 40


def test_too_wide_models_are_refused(ask: Ask) -> None:
    model = encoded(random_model((160, 1)))
    for name, request in {"shadertoy": [model, -1, None], "glsl": model}.items():
        with pytest.raises(Exception, match="160 wide"):
            ask(name, request)


FUNCTIONS = {
    "spot-small": load(FOLDER / "spot-small.safetensors"),
    "one level, a reserved name": random_model((12, 3), name="Mix"),
    "three levels, texture": random_model((6, 1), (8, 0), (5, 1), texture=(10, 1), name="3 é__Größe " * 9),
    "moving": random_model((5, 0), (7, 1), texture=(3, 0), inputs="xyzt"),
}


@pytest.mark.parametrize("model", FUNCTIONS.values(), ids=FUNCTIONS)
def test_the_page_prints_python_s_glsl_function(ask: Ask, model: Model) -> None:
    assert ask("glsl", encoded(model)) == TARGETS["glsl"](model)
