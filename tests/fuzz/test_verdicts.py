"""A model file has one verdict: Python and the page's JavaScript read it, or both refuse it.

Damaged files have a seed that stays the same; the slow test takes a new one from MPLICITS_FUZZ_SEED, or a random one.
"""

import base64
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import pytest
from safetensors.numpy import load as tensors_of
from safetensors.numpy import save as to_safetensors

from mplicits.model.errors import UserError
from mplicits.model.model_file import load, to_bytes
from mplicits.web.bundle import modules, script
from mplicits.web.facts import facts_json
from support.changed_header import changed, describe
from support.fuzzing import damaged_model, fresh_seed
from support.packed_model import packed_model
from support.random_model import random_model

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
MODEL = random_model((8, 1), (6, 0), texture=(4, 0))
FILES = {
    "plain": to_bytes(MODEL),
    "packed": to_bytes(packed_model(MODEL)),
    "front": to_bytes(replace(MODEL, front=(30.0, 20.0), credit="somebody", up="z")),
}


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


def stray(data: bytes) -> bytes:
    """Return a packed file with a tensor of the model beside the packed ones."""
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    plain = tensors_of(FILES["plain"])
    tensors = tensors_of(data) | {"level1.layer0.bias": plain["level1.layer0.bias"]}
    return to_safetensors(tensors, header["__metadata__"])


def described(**values: object) -> Callable[[bytes], bytes]:
    """Return a change of values of the description."""
    return lambda data: changed(data, describe(lambda description: description.update(values)))


WRONG: dict[str, tuple[str, Callable[[bytes], bytes]]] = {
    "lipschitz": ("packed", lambda data: changed(data, describe(lambda d: d["levels"][0].update(lipschitz=-1.0)))),
    "scale": ("packed", described(scale=0)),
    "centre": ("packed", described(centre=[0, 0])),
    "no provenance": ("plain", lambda data: changed(data, describe(lambda d: d.pop("provenance")))),
    "trailing bytes": ("packed", lambda data: data + b"12345678"),
    "trailing bytes of a plain file": ("plain", lambda data: data + b"\0"),
    "a stray tensor": ("packed", stray),
    "version 3 without the packed tensor": (
        "plain",
        lambda data: changed(data, lambda h: h["__metadata__"].update(version="3")),
    ),
    "a number as version": ("plain", lambda data: changed(data, lambda h: h["__metadata__"].update(version=1))),
    "more weights than are read": (
        "packed",
        lambda data: changed(data, describe(lambda d: d["packed"].update(level1=[3, 4000, 4000, 1]))),
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_both_refuse(name: str, page_verdicts: Verdicts, tmp_path: Path) -> None:
    kind, spoil = WRONG[name]
    assert check([spoil(FILES[kind])], page_verdicts, tmp_path) == 1


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
