"""The line that `bake` prints about rounded weights: it is about the weights that the file has."""

import re
from pathlib import Path

import pytest

from mplicits import cli
from mplicits.bake.registry import TARGETS
from mplicits.field.rounding import in_decimals, rounding_error
from mplicits.model.model_file import save
from support.page_pictures import MODEL, use_small_posters


@pytest.fixture(autouse=True)
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_small_posters(monkeypatch)
    monkeypatch.chdir(tmp_path)
    save(MODEL, Path("m.safetensors"))


def line(capsys: pytest.CaptureFixture[str], model: str, *options: str) -> str | None:
    """Return the line about rounding of a bake, or None."""
    assert cli.main(["bake", model, "-o", "out", "--force", *options]) == 0
    return next((line for line in capsys.readouterr().err.splitlines() if "off by" in line), None)


@pytest.mark.parametrize("target", sorted(TARGETS))
def test_decimals_cost_what_the_line_says(target: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = line(capsys, "m.safetensors", "--target", target, "--digits", "1")
    assert said
    assert said.startswith("weights of 1 decimal: ")
    figures = [float(number) for number in re.findall(r"\d\.\de-\d\d", said)]
    assert figures == pytest.approx(rounding_error(MODEL, in_decimals(MODEL, 1)), rel=0.05)


@pytest.mark.parametrize(("options", "words"), [(["html"], "weights of 16 bits: "), (["html", "--studio"], None)])
def test_the_line_is_about_the_page_that_is_written(
    options: list[str], words: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    said = line(capsys, "spot-small", "--target", *options)
    assert said is None if words is None else (said or "").startswith(words)
