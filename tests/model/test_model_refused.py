"""A model file that is wrong in any way is refused with one line that names what is wrong."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from mplicits.model.errors import UserError
from mplicits.model.files import show
from mplicits.model.model_file import load, save
from support.random_model import random_model


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A saved model of two levels and a texture."""
    path = tmp_path / "m.safetensors"
    save(random_model((8, 1), (12, 2), texture=(8, 1)), path)
    return path


def refusal(path: Path) -> str:
    """The one line with which `load` refuses a file, without the path at its beginning."""
    with pytest.raises(UserError) as caught:
        load(path)
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    assert line.startswith(f"{show(path)}: ")
    assert line.isprintable()
    return line.removeprefix(f"{show(path)}: ")


def described(path: Path) -> dict[str, Any]:
    """The JSON object that describes the model in a model file."""
    with safe_open(path, "numpy") as file:
        description: dict[str, Any] = json.loads(file.metadata()["model"])
    return description


def rewrite(path: Path, metadata: dict[str, str] | None = None, tensors: dict[str, Any] | None = None) -> None:
    """Write the model file `path` again with other metadata or tensors."""
    whole = {"format": "mplicits", "version": "1", "model": json.dumps(described(path))} | (metadata or {})
    save_file(load_file(path) if tensors is None else tensors, path, whole)


def test_every_truncation_is_refused(path: Path) -> None:
    whole = path.read_bytes()
    for size in [*range(0, 64), *range(64, len(whole), 97), len(whole) - 1]:
        path.write_bytes(whole[:size])
        assert "damaged" in refusal(path)


def test_corruption_causes_only_user_errors(path: Path) -> None:
    whole = path.read_bytes()
    header = 8 + int.from_bytes(whole[:8], "little")
    rng = np.random.default_rng(0)
    lines = []
    for trial in range(1500):
        data = bytearray(whole)
        for position in rng.integers(0, header if trial % 3 else len(data), 1 + trial % 4):
            data[position] = rng.integers(0, 256)
        path.write_bytes(data)
        try:
            load(path).sha256()
        except UserError as error:
            lines.append(str(error))
    assert len(lines) > 700
    assert all(line.isprintable() for line in lines)


FLOATS = [1.5, 1e39, 1e-300, math.nan, math.inf, -math.inf]
VALUES: list[object] = [None, True, False, "", "1", "\n", -1, 0, 10**400, *FLOATS, [], [[[]]], {}, {"loss": math.inf}]
VALUES += [{"delta": 1}, ["x"] * 3, [True] * 3]
PLACES: list[tuple[str | int, ...]] = [(key,) for key in ("name", "inputs", "scale", "centre", "provenance", "levels")]
LEVEL_NUMBERS = ("delta", "iterations", "lipschitz", "step_bound", "band_step_bound")
PLACES += [("levels", 1), *(("levels", 0, key) for key in LEVEL_NUMBERS)]


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_other_json_values_cause_only_user_errors(place: tuple[Any, ...], path: Path) -> None:
    loaded = []
    for value in VALUES:
        description = described(path)
        inner: Any = description
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = value
        bad = path.with_name("bad")
        bad.write_bytes(path.read_bytes())
        rewrite(bad, {"model": json.dumps(description).replace("Infinity", "1e999")})
        try:
            load(bad)
            loaded.append(value)
        except UserError:
            assert place[0] in refusal(bad) or "NaN is not a number of JSON" in refusal(bad)
    # Neither a text nor a truth value passes for a number.
    assert loaded == {
        "name": ["1", "\n"],
        "provenance": [{}, {"delta": 1}],
        "scale": [1.5],
        "delta": [1.5],
        "lipschitz": [1.5],
    }.get(place[-1], [])


@pytest.mark.parametrize(
    ("metadata", "said"),
    [
        ({"format": "pt"}, "'format'"),
        ({"version": "4"}, "format version 4 is newer than this program reads (3); update mplicits"),
        ({"version": "3"}, "packed: the tensor or the sizes of the networks are missing"),
        ({"version": "2"}, "key 'shapes' is missing"),
        ({"version": "9" * 5000}, "'version'"),
        ({"version": "0"}, "'version'"),
        ({"version": ""}, "'version'"),
        ({"version": "one\ntwo"}, "'version'"),
        ({"model": ""}, "'model' is not JSON"),
        ({"model": "not JSON\n"}, "'model' is not JSON"),
        ({"model": "[" * 100_000}, "'model' is not JSON"),
        ({"model": "[1]"}, "'model'"),
        ({"model": "9" * 10_000}, "'model'"),
        ({"model": "{}"}, "'name' is missing"),
    ],
)
def test_bad_metadata_is_refused_by_name(metadata: dict[str, str], said: str, path: Path) -> None:
    rewrite(path, metadata)
    assert said in refusal(path)


def test_missing_metadata_and_other_safetensors_files_are_refused(path: Path) -> None:
    save_file(load_file(path), path)
    assert "not an mplicits model" in refusal(path)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    assert "not a model file" in refusal(path)
    path.write_bytes(b"")
    assert "not a model file" in refusal(path)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("spot.obj", "a mesh; train it with: mplicits train spot.obj"),
        ("my cow.PLY", "a mesh or a point cloud; train it with: mplicits train 'my cow.PLY'"),
        ("-x.npz", "a point cloud; train it with: mplicits train ./-x.npz"),
    ],
)
def test_a_shape_gets_another_message_than_a_damaged_model(
    name: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_text("v 0 0 0\n")
    assert refusal(Path(name)) == said


def with_one(value: float, shape: tuple[int, ...]) -> Any:
    """An array of zeros with `value` at its end."""
    array = np.zeros(shape, np.float32)
    array.flat[-1] = value
    return array


@pytest.mark.parametrize(
    ("name", "tensor", "said"),
    [
        ("level2.layer1.bias", with_one(np.nan, (12,)), "has values that are not finite"),
        ("texture.layer0.weight", with_one(-np.inf, (8, 3)), "has values that are not finite"),
        ("level1.layer0.weight", np.zeros((8, 2), np.float32), "shape (8, 2), expected (out, 3)"),
        ("level1.layer0.weight", np.zeros(8, np.float32), "shape (8,), expected (out, 3)"),
        ("level1.layer0.weight", np.zeros((0, 3), np.float32), "0 outputs, expected 1 to 4096"),
        ("level1.layer0.weight", np.zeros((4097, 3), np.float32), "4097 outputs, expected 1 to 4096"),
        ("level1.layer2.weight", np.zeros((3, 8), np.float32), "3 outputs, expected 1"),
        ("level1.layer1.bias", np.zeros(9, np.float32), "shape (9,), expected (8,)"),
        ("level1.layer1.bias", np.zeros((), np.float32), "shape (), expected (8,)"),
        ("level2.layer1.weight", np.zeros((12, 8), np.float32), "shape (12, 8), expected (out, 12)"),
        ("level2.layer0.bias", np.zeros(12, np.float64), "must be float32"),
        ("level2.layer0.bias", np.zeros(12, np.int32), "must be float32"),
        ("texture.layer2.weight", np.zeros((1, 8), np.float32), "1 outputs, expected 3"),
        ("level2.layer1.bias", None, "missing"),
        ("level3.layer0.weight", np.zeros((1, 3), np.float32), "not a tensor of a model with 2 levels"),
        ("extra\nline", np.zeros(1, np.float32), "not a tensor of a model"),
    ],
)
def test_a_bad_tensor_is_refused_by_name(name: str, tensor: Any, said: str, path: Path) -> None:
    changed = load_file(path) | {name: tensor}
    rewrite(path, tensors={key: value for key, value in changed.items() if value is not None})
    line = refusal(path)
    assert line.startswith(f"{show(name)}: ")
    assert said in line


@pytest.mark.parametrize(
    "name", ["level2", "level2.layer0.weight", "level1.layer0.weight", "texture.layer0.weight", "level1.layer2.weight"]
)
def test_a_missing_tensor_is_refused(name: str, path: Path) -> None:
    rewrite(path, tensors={key: value for key, value in load_file(path).items() if not key.startswith(name)})
    assert name.removesuffix(".weight") in refusal(path)


@pytest.mark.parametrize("dtype", ["BF16", "F8_E4M3", "F16", "I32"])
def test_a_tensor_of_a_type_numpy_lacks_is_refused(dtype: str, path: Path) -> None:
    width = {"BF16": 2, "F16": 2, "F8_E4M3": 1, "I32": 4}[dtype]
    header = {
        "level1.layer0.weight": {"dtype": dtype, "shape": [2], "data_offsets": [0, 2 * width]},
        "__metadata__": {"format": "mplicits", "version": "1", "model": "{}"},
    }
    text = json.dumps(header).encode()
    path.write_bytes(len(text).to_bytes(8, "little") + text + bytes(2 * width))
    assert refusal(path) == "level1.layer0.weight: must be float32"


def test_a_path_that_is_no_file_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "nothing") == "no such file"
    assert refusal(tmp_path) == "not a file"
    assert refusal(Path("/dev/null")) == "not a file"
    assert refusal(tmp_path / "a\nb") == "no such file"
    assert "too long" in refusal(tmp_path / ("x" * 300))
