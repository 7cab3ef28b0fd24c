"""A page whose scripts or shaders differ in some lines, for tests."""

from collections.abc import Iterable
from typing import Any

import pytest

from mplicits import glsl
from mplicits.model.model import Model
from mplicits.web.bundle import sources
from mplicits.web.document import Studio, packed
from mplicits.web.page import page_of
from support.paths import ROOT


def changed_page(model: Model, changes: Iterable[tuple[str, str]], **options: Any) -> str:
    """Return the page of a model, with exact weights. changes: (old, new), each of a line that stands once."""
    scripts, read = dict(sources()), glsl.read
    shaders = {path.name: path.read_text("utf-8") for path in (ROOT / "glsl").glob("*/*.glsl")}
    for old, new in changes:
        found = [(texts, name) for texts in (scripts, shaders) for name, text in texts.items() if old in text]
        ((texts, name),) = found
        assert texts[name].count(old) == 1
        texts[name] = texts[name].replace(old, new)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mplicits.web.bundle.sources", lambda: scripts)
        patch.setattr("mplicits.glsl.read", lambda name: shaders.get(name) or read(name))
        return packed(page_of(model, studio=Studio(), **options)[0]).text
