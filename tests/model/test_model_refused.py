"""A model file that is wrong in any way is refused with one line that names what is wrong."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from mplicits.model.errors import UserError
from mplicits.model.files import show
from mplicits.model.model_file import load
from support.broken_models import FILES, WRONG, metadata, parts


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A saved model of two levels and a texture."""
    path = tmp_path / "m.safetensors"
    path.write_bytes(FILES["plain"])
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


def test_every_truncation_is_refused(path: Path) -> None:
    whole = path.read_bytes()
    for size in [*range(0, 64), *range(64, len(whole), 97), len(whole) - 1]:
        path.write_bytes(whole[:size])
        assert "damaged" in refusal(path)


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
        description = json.loads(parts(path.read_bytes())[0]["__metadata__"]["model"])
        inner: Any = description
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = value
        bad = path.with_name("bad")
        text = json.dumps(description).replace("Infinity", "1e999")
        bad.write_bytes(metadata(model=text)(path.read_bytes()))
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


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_by_what_is_wrong(name: str, path: Path) -> None:
    path.write_bytes(WRONG[name].data)
    assert WRONG[name].said in refusal(path)


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
