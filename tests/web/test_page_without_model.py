"""A page without a model of its own: every key and a lost context do no harm, and a dropped model appears."""

from pathlib import Path
from typing import TYPE_CHECKING

from mplicits.model.model_file import to_bytes
from mplicits.web.document import packed
from mplicits.web.page import empty_page
from support.browser import visit
from support.page_pictures import MODEL

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def test_a_page_without_a_model_waits_for_one(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "empty.html"
    file.write_text(packed(empty_page("an <empty> stage")).text, encoding="utf-8")
    with visit(browser, file, share=0.05, hash_="#turntable=20") as visited:
        visited.until("'ready' in document.documentElement.dataset")
        assert visited.page.title() == "an <empty> stage"
        for key in ("s", "1", "9", "p", "t", "x", "r", "h", "h", " ", "+", "ArrowLeft", "Escape"):
            visited.page.keyboard.press(key)
        visited.drop(b"not a model", "other.safetensors")
        visited.page.wait_for_selector("#message:not([hidden])")
        for hidden in ("#side", "#fold", "header", "#status", "#poster", "#progress"):
            assert not visited.page.is_visible(hidden), hidden
        visited.lose_context()
        visited.restore_context()
        visited.drop(to_bytes(MODEL), "ball.safetensors")
        visited.until("document.documentElement.dataset.error")
        visited.still()
        assert visited.message() == ""
        assert visited.page.is_visible("#status")
        assert visited.page.title() == "fitted"
        assert float(visited.root("error") or "nan") < 1e-5
        assert visited.console == []
