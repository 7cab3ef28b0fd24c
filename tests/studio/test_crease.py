"""The setting of creases in the studio."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model.model_file import load
from mplicits.trainer.options import CREASE
from mplicits.web.studio_page import page_facts, studio
from support.browser import visit
from support.page_scripts import run
from support.studio_visit import CONFIG, RADIUS, ball, ready, save

if TYPE_CHECKING:
    from playwright.sync_api import Browser

CREASES = """(texts) => texts.map((crease) => {
    try {
        return settingsFrom("tiny", {crease}).crease;
    } catch (error) {
        return error.message;
    }
})"""
FILL = """(texts) => {
    for (const [name, text] of Object.entries(texts)) document.getElementById("settings").elements[name].value = text;
}"""


def test_a_crease_is_an_angle_or_flat(browser: "Browser") -> None:
    page = browser.new_page()
    page.evaluate("(facts) => Object.assign(window, {facts: {studio: facts}, ModelError: Error})", page_facts())
    found = run(page, ("settings.js",), CREASES, ["", " 12.5 ", "flat", "200", "round"])
    refused = [f'crease: "{text}" is not a number from 0 to 180' for text in ("200", "round")]
    assert found == [CREASE, 12.5, None, *refused]
    page.close()


@pytest.mark.slow
def test_a_shape_is_trained_again_with_flat_faces(browser: "Browser", tmp_path: Path) -> None:
    path = tmp_path / "studio.html"
    path.write_text(studio(CONFIG), encoding="utf-8")
    with visit(browser, path, size=(390, 844), share=0.1) as visited:
        ready(visited)
        visited.page.evaluate(FILL, {"levels": "8x1", "seconds": "1"})
        visited.drop(ball(), "a ball.stl")
        visited.page.wait_for_selector("#download")
        save(visited, "#download", tmp_path / "curved.safetensors")
        visited.page.evaluate(FILL, {"crease": "flat"})
        before = visited.page.query_selector("#download")
        visited.page.evaluate("document.getElementById('again').click()")
        visited.page.wait_for_function("(button) => !button.isConnected", arg=before)
        visited.page.wait_for_selector("#download")
        save(visited, "#download", tmp_path / "flat.safetensors")
        assert [line for line in visited.console if "GPU stall" not in line] == []  # the driver's, of reading pixels
    curved, flat = (load(tmp_path / f"{name}.safetensors") for name in ("curved", "flat"))
    assert [model.provenance["source"].get("crease") for model in (curved, flat)] == [CREASE, None]
    assert abs(flat.scale / RADIUS - 1) < 1e-6
    assert 1e-5 < curved.scale / RADIUS - 1 < 2e-4  # the curved surface bulges beyond the corners
