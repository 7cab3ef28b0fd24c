"""The studio where things happen early, late or at once: drops, a lost context, a save that failed."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model.model_file import to_bytes
from support.browser import Visit, visit
from support.random_model import random_model
from support.studio_visit import ball, ready, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Dialog

pytestmark = pytest.mark.slow

HELD = """
const {postMessage} = Worker.prototype, held = [];
Worker.prototype.postMessage = function (question, ...more) {
    const ask = () => postMessage.call(this, question, ...more);
    if (question.name === "read") held.push(ask);
    else ask();
};
window.held = held;
window.read = () => held.splice(0).forEach((ask) => ask());"""
"""Holds the reading of shapes."""
LISTEN = """() => {
    const line = document.querySelector("#message p"), messages = window.messages = [];
    const listener = new MutationObserver(() => messages.push(line.textContent));
    listener.observe(line, {childList: true, characterData: true, subtree: true});
}"""
"""Records all messages."""


def said(visited: Visit, text: str) -> None:
    """Wait for a message."""
    visited.page.wait_for_function("text => document.querySelector('#message p').textContent === text", arg=text)


def test_a_training_keeps_the_stage(browser: "Browser", tmp_path: Path) -> None:
    """Until the visitor gives it to another file that is dropped, and through a lost context."""
    file = write_page(tmp_path / "studio.html", (60, 200_000, 60))
    asked: list[str] = []

    def refuse(dialog: "Dialog") -> None:
        asked.append(dialog.message)
        dialog.dismiss()

    with visit(browser, file, size=(500, 400), share=0.1, script=HELD) as visited:
        page = visited.page
        page.on("dialog", refuse)
        ready(visited)
        visited.drop(ball(), "ball.stl")
        visited.until("document.getElementById('report').textContent === 'Reading'")
        visited.drop(ball(), "second.stl")
        said(visited, "second.stl: not opened")
        page.evaluate("window.read()")
        visited.until("document.getElementById('report').textContent.startsWith('Level 2')")
        visited.until("!document.documentElement.hasAttribute('data-preview')")  # the field is drawn
        visited.drop(to_bytes(random_model((4, 0), name="other")), "other.safetensors")
        said(visited, "other.safetensors: not opened")
        assert asked == [f"Stop this training and open {name}?" for name in ("second.stl", "other.safetensors")]
        assert page.title() == "ball"
        visited.lose_context()
        visited.until("document.documentElement.dataset.state === 'lost'")
        visited.restore_context()
        visited.until("document.documentElement.dataset.state === 'drawing'")
        assert visited.message() == ""
        assert page.locator("#level input").count() == 2
        page.click("#stop")
        page.wait_for_selector("#download")
        visited.still()
        assert (page.title(), visited.message(), visited.console) == ("ball", "", [])


@pytest.mark.parametrize("moment", ["reading", "training"])
def test_another_shape_takes_the_stage_where_the_visitor_agrees(
    moment: str, browser: "Browser", tmp_path: Path
) -> None:
    file = write_page(tmp_path / "studio.html", (200_000, 60, 60))
    with visit(browser, file, size=(500, 400), share=0.1, script=HELD if moment == "reading" else "") as visited:
        page = visited.page
        page.on("dialog", lambda dialog: dialog.accept())
        ready(visited)
        visited.drop(ball(), "ball.stl")
        line = "Reading" if moment == "reading" else "Level 1"
        visited.until(f"document.getElementById('report').textContent.startsWith('{line}')")
        visited.drop(ball(), "second.stl")
        if moment == "reading":
            page.evaluate("window.read()")
            visited.until("document.title === 'ball' && window.held.length")
            page.evaluate("window.read()")
        visited.until("document.title === 'second'")
        visited.until("document.getElementById('report').textContent.startsWith('Level 1')")
        assert (page.title(), visited.message(), visited.console) == ("second", "", [])


def test_a_video_that_lost_its_context_may_be_recorded_again(browser: "Browser", tmp_path: Path) -> None:
    recording = "document.getElementById('report').textContent === 'Recording the video'"
    with visit(browser, write_page(tmp_path / "studio.html", 60), size=(500, 400), share=0.1) as visited:
        page = visited.page
        ready(visited)
        visited.drop(ball(), "ball.stl")
        page.wait_for_selector("#download")
        visited.still()
        report = page.inner_text("#report")
        page.click("#save-webm")
        visited.until(recording)
        page.evaluate(LISTEN)
        visited.lose_context()
        # The message of the lost context may come before or after it.
        visited.until("window.messages.includes('the recording was stopped')")
        visited.until("document.documentElement.dataset.state === 'lost'")
        assert page.inner_text("#report") == report
        visited.restore_context()
        visited.still()
        assert visited.message() == ""
        page.click("#save-webm")
        visited.until(recording)
        assert visited.console == []
