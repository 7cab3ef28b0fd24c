"""What `mplicits info` prints for people, whatever a file's provenance holds."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from mplicits import cli
from mplicits.bake.registry import TARGETS
from mplicits.model.model_file import save
from support.random_model import random_model

RECORD = {"mean_f": 1.5e-4, "angle": 2.25, "steps": 100}
SURFACE = {"distance_mean": 1e-4, "missing_mean": 3e-4, "normal_angle": 2.5, "invented": 0.42}


@pytest.fixture(autouse=True)
def one_target(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.bake.facts.TARGETS", {"c": TARGETS["c"]})


@pytest.mark.parametrize(
    "provenance",
    [
        {},
        {"source": "text", "levels": "text", "seconds": "text", "field": []},
        {"levels": 3, "seconds": 3},
        {"source": {"moments": [3, {"file": 4}]}},
        {"seconds": 10**15, "levels": [[]]},
        {"levels": [{}], "seconds": 3, "source": {"file": 1}},
        {"levels": [1, 2], "seconds": 3, "source": {"file": "a", "sha256": 4}, "field": {"domain_error": "x"}},
    ],
)
def test_any_provenance_is_described(
    provenance: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(dataclasses.replace(random_model((4, 0), (4, 1)), provenance=provenance), tmp_path / "m.safetensors")
    assert cli.main(["info", str(tmp_path / "m.safetensors")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "random"
    assert [line for line in lines if line.split()[:2] == ["2", "4x1"]]
    assert not any("{" in line or "mean |f|" in line for line in lines)


def test_a_model_s_maker_view_and_figures_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    notes = {
        "source": {"file": "spot\n.obj", "sha256": "0123456789abcdef"},
        "seconds": 61.2,
        "seed": 4,
        "levels": [RECORD, RECORD],
        "field": {"domain_error": 0.0123},
        "surface": {"shape": SURFACE, "flat": SURFACE | {"normal_angle": 7.5}, "open": True},
    }
    model = dataclasses.replace(
        random_model((4, 0), (4, 1), texture=(8, 1)), provenance=notes, credit="A.\nB", front=(215, 15), up="z"
    )
    save(model, tmp_path / "m.safetensors")
    assert cli.main(["info", str(tmp_path / "m.safetensors")]) == 0
    text = capsys.readouterr().out
    for part in (
        "random, by A.\\nB",
        "colors by 8x1",
        "z is up",
        "215 degrees around, 15 above",
        "spot\\n.obj, sha256 0123456789ab",
        "61 s, seed 4, steps 100, 100",
        "off by 1.2e-02",
        "1.5e-04    2.2",
        "surface     off by 2.00e-04 (mean of both directions), normals by 2.50 degrees",
        "flat faces  off by 2.00e-04 (mean of both directions), normals by 7.50 degrees",
        "--thicken",
    ):
        assert part in text
    assert max(map(len, text.splitlines())) < 170


def test_targets_are_baked_for_their_sizes_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A page counts with its poster, as `bake` writes it."""
    model = random_model((4, 0), (4, 1))
    save(model, tmp_path / "m.safetensors")
    calls = []

    def bake(*arguments: object, **_: object) -> str:
        calls.append(arguments)
        return "twelve bytes"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mplicits.codegen.targets.c.standalone", bake)
        assert cli.main(["info", str(tmp_path / "m.safetensors")]) == 0
        assert not calls
        assert "bytes as" not in capsys.readouterr().out
        assert cli.main(["info", str(tmp_path / "m.safetensors"), "--sizes"]) == 0
        assert "bytes as    c 12" in capsys.readouterr().out
    page = TARGETS["html"]
    assert page.size(model) == len(page(model).encode())
