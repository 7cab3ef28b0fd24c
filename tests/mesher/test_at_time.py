"""The time of a model that moves, and where its shape then lies."""

from dataclasses import replace
from pathlib import Path

import pytest

from mplicits import cli
from mplicits.mesher.at_time import chosen_time, place_at
from mplicits.mesher.options import MeshOptions
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from support.paths import DEMO
from support.random_model import random_model


def moving(**source: object) -> Model:
    model = random_model((8, 1), inputs="xyzt")
    return replace(model, center=(9.0, 9.0, 9.0), scale=3.0, provenance={"source": source})


def moment(center: tuple[float, float, float], scale: float, offset: float = 0.0, factor: float = 1.0) -> object:
    return {"centre": list(center), "scale": scale, "offset": [offset, 0, 0], "factor": factor}


def test_the_place_goes_from_the_first_shape_s_to_the_last_s() -> None:
    model = moving(moments=[moment((0, 0, 0), 1.0), moment((2, 0, 4), 3.0)])
    assert place_at(model, 0.0) == ((0, 0, 0), 1, "y")
    assert place_at(model, 0.5) == ((1, 0, 2), 2, "y")
    assert place_at(model, 1.0) == ((2, 0, 4), 3, "y")


def test_shapes_in_one_space_have_one_place() -> None:
    # Balls of radius 1 at x = 5 and 7, in a space of center 6 and scale 2.
    model = moving(moments=[moment((5, 0, 0), 1.0, -0.5, 0.5), moment((7, 0, 0), 1.0, 0.5, 0.5)])
    for time in (0.0, 0.3, 1.0):
        assert place_at(model, time) == ((6, 0, 0), 2, "y")


@pytest.mark.parametrize("moments", [None, [], [{}, {}], [{"factor": 0, "scale": 1, "centre": [0] * 3}] * 2, "ab"])
def test_a_place_that_is_not_noted_is_the_model_s(moments: object) -> None:
    model = moving(moments=moments)
    assert place_at(model, 0.5) == model.place


def test_a_wrong_time_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = moving()
    assert chosen_time(None, model) == 0
    assert chosen_time(1.0, model) == 1
    for time in (-0.1, 1.5, float("nan")):
        with pytest.raises(UserError, match="from 0 to 1"):
            MeshOptions(time=time)
    for verb in (["mesh", str(DEMO), "-o", str(tmp_path / "m.ply")], ["eval", str(DEMO), str(DEMO)]):
        assert cli.main([*verb, "--time", "0.5"]) == 2
        assert "does not move" in capsys.readouterr().err
