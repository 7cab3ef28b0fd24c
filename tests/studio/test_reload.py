"""After a reload, the studio offers the shape of the last visit, with the levels that were finished."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model.model_file import load
from support.browser import visit
from support.studio_visit import ready, recorded, save, until_recorded, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser

STEPS = {"whole": 60, "unfinished": 200_000}
"""Steps of the second level and of the texture: it ends at once, or never."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["whole", "unfinished"])
def test_a_reload_offers_the_last_shape(kind: str, browser: "Browser", tmp_path: Path) -> None:
    page = write_page(tmp_path / "studio.html", (60, STEPS[kind], 60))
    with visit(browser, page, share=0.1) as visited:
        visited.page.on("dialog", lambda dialog: dialog.accept())  # leaving asks
        ready(visited)
        assert not visited.page.is_visible("#resume")
        visited.page.click("text=Gear")
        if kind == "whole":
            visited.page.wait_for_selector("#download")
        until_recorded(visited, levels=2 if kind == "whole" else 1, texture=False)
        report = visited.page.inner_text("#report")
        visited.page.reload()
        visited.page.click("text=Go on with gear")
        if kind == "unfinished":
            visited.until("document.getElementById('report').textContent.startsWith('Level 2')")
            visited.page.click("#stop")
        visited.page.wait_for_selector("#download")
        if kind == "whole":
            assert visited.page.inner_text("#report") == report, "it trained again"
        save(visited, "#download", tmp_path / "gear.safetensors")
        model = load(tmp_path / "gear.safetensors")
        assert (model.name, len(model.levels)) == ("gear", 2)
        assert model.provenance["levels"][0]["steps"] == 60
        visited.page.reload()
        visited.page.click("text=Forget it")
        visited.page.wait_for_selector("#resume", state="hidden")
        assert recorded(visited) is None
        visited.page.reload()
        ready(visited)
        assert recorded(visited) is None
        assert not visited.page.is_visible("#resume")
        assert visited.console == []
