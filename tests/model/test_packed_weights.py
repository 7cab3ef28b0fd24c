"""Packed weights come back bit for bit, and a wrong file is refused in one line, quickly."""

import json
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open

from mplicits.model.errors import UserError
from mplicits.model.model import Layer, Model
from mplicits.model.model_file import load, save, to_bytes
from mplicits.model.packed_weights import pack, sizes_of, unpack
from mplicits.model.range_coder import Decoder, Encoder
from support.packed_model import packed_model
from support.random_model import random_model


@pytest.fixture
def model() -> Model:
    """A model with large, small and zero weights, and one that is far larger than the others of its layer."""
    model = packed_model(random_model((8, 1), (12, 2), texture=(8, 1)))
    layer = model.levels[0].network[1]
    layer.weight[0, 0] = 64.0
    layer.weight[2], layer.bias[2] = 0.0, 0.0
    return model


def same(one: Model, other: Model) -> bool:
    """Whether two models have the same tensors, bit for bit but for the sign of 0."""
    return one.tensors().keys() == other.tensors().keys() and all(
        np.array_equal(tensor, other.tensors()[name]) for name, tensor in one.tensors().items()
    )


def test_packed_models_come_back(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "m.safetensors"
    save(model, path)
    with safe_open(path, "numpy") as file:
        assert file.metadata()["version"] == "3"
        assert list(file.keys()) == ["packed"]
    again = load(path)
    assert same(model, again)
    assert to_bytes(again) == path.read_bytes()
    assert to_bytes(random_model((8, 1))).count(b'"version":"1"') == 1


def test_numbers_take_the_bits_of_their_entropy() -> None:
    numbers = np.rint(np.random.default_rng(0).normal(scale=2**4, size=20_000)).astype(int).tolist()
    encoder = Encoder()
    for number in numbers:
        encoder.number(number, 16)
    data = encoder.finish()
    entropy = math.log2(2**4 * math.sqrt(2 * math.pi * math.e))
    assert 8 * len(data) / len(numbers) == pytest.approx(entropy, rel=0.01)
    decoder = Decoder(data)
    assert [decoder.number(16) for _ in numbers] == numbers


@pytest.mark.parametrize("quarters", [-40, -8, 0, 23, 24, 25, 60, 84])
def test_any_number_is_written_with_any_bell(quarters: int) -> None:
    numbers = [0, 1, -1, 2, -7, 1000, -1000, 2**20, -(2**20), 0]
    encoder = Encoder()
    for number in numbers:
        encoder.number(number, quarters)
    decoder = Decoder(encoder.finish())
    assert [decoder.number(quarters) for _ in numbers] == numbers


def test_other_weights_are_not_packed(model: Model) -> None:
    assert pack(random_model((8, 1)).networks()) is None
    network = model.levels[0].network
    changed = replace(network[1], bias=network[1].bias + np.float32(1 / 3))
    assert pack({"level1": (network[0], changed, *network[2:])}) is None


def test_zeros_are_padded_to_an_eighth_of_a_byte_each() -> None:
    zeros = (Layer(np.zeros((64, 64), np.float32), np.zeros(64, np.float32)),) * 2
    data = pack({"a": zeros})
    assert data is not None
    assert len(data) == 1024
    assert not unpack({"a": sizes_of(zeros)}, data)["a.layer0.weight"].any()


def rewritten(data: bytes, packed: object) -> bytes:
    """Return a file with other sizes of its networks."""
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:end])
    description = json.loads(header["__metadata__"]["model"])
    description["packed"] = packed
    header["__metadata__"]["model"] = json.dumps(description)
    text = json.dumps(header).encode()
    return len(text).to_bytes(8, "little") + text + data[end:]


HUGE = [3, *[4096] * 4000, 1]


@pytest.mark.parametrize(
    "sizes",
    [
        *(None, [], 3, {}, {"level1": None}, {"level1": [3, 8]}, {"level1": [3, "8", 1]}, {"level1": [3, True, 1]}),
        *({"level1": [3, -8, 1]}, {"level1": [3, 1e9, 1]}, {"level1": HUGE}, {f"level{i}": HUGE for i in range(9)}),
        *({"level1": [3, 8, 8, 1], "level2": [3, 8, 8, 1]}, {"level1": [3, 9, 9, 1]}, {"training.x": [3, 8, 8, 1]}),
    ],
)
def test_wrong_sizes_are_refused_quickly(sizes: object, tmp_path: Path) -> None:
    path = tmp_path / "m.safetensors"
    path.write_bytes(rewritten(to_bytes(packed_model(random_model((8, 1)))), sizes))
    start = time.process_time()
    with pytest.raises(UserError) as caught:
        load(path)
    assert len(str(caught.value).splitlines()) == 1
    assert time.process_time() - start < 2


def test_damaged_codes_cause_only_user_errors(model: Model) -> None:
    sizes = {prefix: sizes_of(network) for prefix, network in model.networks().items()}
    data = pack(model.networks())
    assert data is not None
    for end in range(0, len(data), 7):
        with pytest.raises(UserError, match="cut short or damaged"):
            unpack(sizes, data[:end])
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(200):
        wrong = bytearray(data)
        for place in rng.integers(0, len(data), 3):
            wrong[place] = rng.integers(0, 256)
        try:
            unpack(sizes, bytes(wrong))
        except UserError:
            refused += 1
    assert refused > 190


def test_more_weights_than_are_read_in_seconds_are_refused() -> None:
    with pytest.raises(UserError, match="packed: 16,016,000 weights; at most 4,194,304 are read"):
        unpack({"level1": [3, 4000, 4000, 1]}, bytes(1 << 21))
