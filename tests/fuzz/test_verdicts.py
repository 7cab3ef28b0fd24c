"""A model file has one verdict: Python and the page's JavaScript read it, or both refuse it.

Damaged files have a seed that stays the same; the slow test takes a new one from MPLICITS_FUZZ_SEED, or a random one.
"""

import base64
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import pytest

from mplicits.model.errors import UserError
from mplicits.model.model_file import load
from mplicits.web.bundle import modules, script
from mplicits.web.facts import facts_json
from support.broken_models import FILES, WRONG
from support.fuzzing import damaged_model, fresh_seed

if TYPE_CHECKING:
    from playwright.sync_api import Browser

Verdicts = Callable[[list[bytes]], list[str]]
ASK = """
window.verdicts = (files) => files.map((text) => {
    try {
        parseModel(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
        return "";
    } catch (error) {
        return error instanceof ModelError ? error.message : `NOT A LINE FOR PEOPLE: ${error}`;
    }
});
null;
"""


@pytest.fixture(scope="module")
def page_verdicts(browser: "Browser") -> Iterator[Verdicts]:
    """Return a function that returns the page's messages about files; "" for a model."""
    page = browser.new_page()
    page.set_content(f'<!doctype html><script type="application/json" id="facts">{facts_json({})}</script>')
    page.evaluate(script(modules("safetensors.js", "field.js")) + ASK)
    yield lambda files: page.evaluate("files => verdicts(files)", [base64.b64encode(data).decode() for data in files])
    page.close()


def refusal(data: bytes, folder: Path) -> str:
    """Return Python's message about a file; "" for a model."""
    path = folder / "m.safetensors"
    path.write_bytes(data)
    try:
        load(path)
    except UserError as error:
        return str(error)
    return ""


def check(files: list[bytes], page_verdicts: Verdicts, folder: Path) -> int:
    """Compare the verdicts of both. Returns the number of files that are refused."""
    refused = 0
    for data, theirs in zip(files, page_verdicts(files), strict=True):
        ours = refusal(data, folder)
        if bool(ours) != bool(theirs) or "NOT A LINE" in theirs:
            kept = folder / "disputed.safetensors"
            kept.write_bytes(data)
            pytest.fail(f"Python: {ours or 'a model'}; the page: {theirs or 'a model'}; see {kept}", pytrace=False)
        refused += bool(ours)
    return refused


@pytest.mark.parametrize("name", WRONG)
def test_the_page_refuses_a_wrong_file_as_python_does(name: str, page_verdicts: Verdicts) -> None:
    wrong = WRONG[name]
    (said,) = page_verdicts([wrong.data])
    assert (wrong.on_page or wrong.said) in said


def test_both_read_whole_files(page_verdicts: Verdicts, tmp_path: Path) -> None:
    assert check([*FILES.values()], page_verdicts, tmp_path) == 0


def cases(seed: int, count: int) -> list[bytes]:
    """Return damaged files."""
    random = Random(seed)
    return [damaged_model(random.choice([*FILES.values()]), random) for _ in range(count)]


def test_damaged_files_have_one_verdict(page_verdicts: Verdicts, tmp_path: Path) -> None:
    assert check(cases(1, 600), page_verdicts, tmp_path) > 300


@pytest.mark.slow
def test_fresh_damage_has_one_verdict(page_verdicts: Verdicts, tmp_path: Path) -> None:
    seed = fresh_seed()
    assert check(cases(seed, 10_000), page_verdicts, tmp_path) > 5000
