"""The studio from a file to its saves: in another Shadertoy player, and with its longest saves."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import av
import numpy as np
import pytest

from mplicits.web.studio_page import studio
from support.browser import visit
from support.studio_visit import ball, ready, save, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

WATCH = """() => {
    window.longest = {};
    let last = performance.now();
    setInterval(() => {
        const now = performance.now(), [stage] = document.getElementById("report").textContent.split(" ");
        window.longest[stage] = Math.max(window.longest[stage] ?? 0, Math.round(now - last - 10));
        last = now;
    }, 10);
}"""
"""Measures the longest time, milliseconds, in which the page answers nothing, by the first word of the report."""


def test_the_page_answers_while_it_trains(browser: "Browser", tmp_path: Path) -> None:
    page_file = tmp_path / "studio.html"
    page_file.write_text(studio(), encoding="utf-8")
    with visit(browser, page_file, size=(900, 500), share=0.2) as visited:
        ready(visited)
        visited.page.check("input[value=tiny]", force=True)
        visited.page.evaluate(WATCH)
        began = time.monotonic()
        visited.page.click("[data-example='0']")
        visited.page.wait_for_selector("#download")
        seconds = time.monotonic() - began
        longest = visited.page.evaluate("window.longest")
        print(f"longest tasks, milliseconds: {longest}")
        assert max(longest["Level"], longest.get("Colors", 0)) < 100 * seconds  # 40 of 10,000 on idle cores
        assert visited.console == []


def test_the_saved_page_draws_and_the_video_plays(browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, write_page(tmp_path / "studio.html", 200), size=(600, 400), share=0.3) as visited:
        ready(visited)
        visited.drop(ball(), "a ball.stl")
        visited.page.wait_for_selector("#download")
        visited.still()
        assert save(visited, "#save-page", tmp_path / "page.html") == "a-ball.html"
        assert save(visited, "#save-webm", tmp_path / "turn.webm") == "a-ball.webm"
        assert visited.page.inner_text("#report").startswith("Trained")
        assert visited.console == []
    with visit(browser, tmp_path / "page.html", share=0.1) as visited:
        visited.still()
        assert visited.page.title() == "a ball"
        assert float(visited.root("error") or "nan") < 1e-5
        assert visited.console == []
    with av.open(str(tmp_path / "turn.webm")) as container:
        frames = [frame.to_ndarray(format="gray") for frame in container.decode(container.streams.video[0])]
    assert len(frames) == 144
    assert all(int(np.ptp(frame)) > 80 for frame in frames)
