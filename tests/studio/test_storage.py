"""The studio's storage in pages from files, in Chromium and Firefox; in Firefox its videos, too."""

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import av
import pytest

from mplicits.web.bundle import script
from support.browser import PATIENCE
from support.firefox import firefox

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

KEEP = """keep({
    vertices: Float64Array.of(1, 2.5, -3), weights: {levels: [Float32Array.of(7, 8)]}, settings: {name: "a"},
})"""
FOUND = """kept().then((record) => record && [
    record.vertices.constructor.name, ...record.vertices, record.weights.levels[0].constructor.name,
    ...record.weights.levels[0], record.settings.name].join(" "))"""
EXPECTED = "Float64Array 1 2.5 -3 Float32Array 7 8 a"
VIDEO = """(async () => {
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    const drawAt = async (share) => { context.fillRect(0, 0, 300 * share, 150); };
    const video = await recordTurntable(canvas, {seconds: 1, fps: 20, drawAt}, () => "");
    return btoa(String.fromCharCode(...new Uint8Array(await video.arrayBuffer())));
})()"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "page.html"
    modules = script(("storage.js", "mesh_parts.js", "webm.js", "recorder.js"))
    path.write_text(f"<!doctype html><title>A page</title><script>{modules}</script>")
    return path


@pytest.fixture
def page(browser: "Browser", file: Path) -> Iterator["Page"]:
    context = browser.new_context()
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(file.as_uri())
    yield page
    context.close()


def test_a_reload_finds_the_last_record(page: "Page") -> None:
    assert page.evaluate("kept()") is None
    assert page.evaluate("keep({vertices: new Float32Array(9)})")
    assert page.evaluate(KEEP)
    page.reload()
    assert page.evaluate(FOUND) == EXPECTED
    page.evaluate("forget()")
    page.reload()
    assert page.evaluate("kept()") is None


def test_what_cannot_be_kept_is_not(page: "Page") -> None:
    assert page.evaluate(KEEP)
    assert page.evaluate("keep({mesh: {vertices: new Float32Array(26e6)}})") is False
    assert page.evaluate("keep({action() {}})") is False
    assert page.evaluate("(() => { const record = {}; record.itself = record; return keep(record); })()") is False
    assert page.evaluate(FOUND) == EXPECTED


@pytest.mark.parametrize("refusal", ["undefined", "{open() { throw new DOMException('no', 'SecurityError'); }}"])
def test_refused_storage_is_silent(page: "Page", refusal: str) -> None:
    page.evaluate(f"Object.defineProperty(window, 'indexedDB', {{value: {refusal}}}); null")
    assert page.evaluate(KEEP) is False
    assert page.evaluate("kept()") is None
    page.evaluate("forget()")


@pytest.mark.slow
def test_firefox_keeps_a_record_and_records_a_video(xvfb: dict[str, str], file: Path) -> None:
    profile = file.parent / "profile"
    profile.mkdir()
    with firefox(profile, xvfb) as browser:

        def resolved(expression: str) -> object:
            browser.evaluate(f"void (window.done = null, {expression}.then((value) => {{ window.done = [value]; }}))")
            browser.until("window.done")
            (value,) = browser.evaluate("window.done")
            return value

        browser.load(file.as_uri())
        assert resolved(KEEP) is True
        video = resolved(VIDEO)
        browser.load()
        assert resolved(FOUND) == EXPECTED
    assert isinstance(video, str)
    with av.open(io.BytesIO(base64.b64decode(video)), "r") as container:
        assert len([*container.decode(video=0)]) == 20
        assert container.duration == pytest.approx(1e6)
