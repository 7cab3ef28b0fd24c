"""Runs functions in the scope of the studio's modules, in Chromium."""

import base64
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from mplicits.web.bundle import modules, script

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

TRAINING = tuple(name for name in modules("training.js", "workers.js", "model_file.js") if name != "facts.js")
"""Modules that train a shape and write its file, for a page without facts."""
WORKER = modules("worker.js")[:-1]
"""Modules of a worker, without what starts it."""
BYTES = """
window.textOf = (array) => {
    const bytes = new Uint8Array(array.buffer ?? array, array.byteOffset, array.byteLength), parts = [];
    for (let i = 0; i < bytes.length; i += 8184) parts.push(String.fromCharCode(...bytes.subarray(i, i + 8184)));
    return btoa(parts.join(""));
};
window.bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
0; // evaluate() would call a function
"""
"""Defines the inverses of `packed` and `unpacked`, in the page."""


def packed(array: np.ndarray) -> str:
    """Return an array's bytes, to pass them to a page."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def unpacked(text: str, kind: str = "u1") -> np.ndarray:
    """Return the array that a page passes. kind: of its numbers."""
    return np.frombuffer(base64.b64decode(text), kind)


@contextmanager
def scope(browser: "Browser", names: tuple[str, ...], functions: str = "") -> Iterator["Page"]:
    """Open a page with BYTES, and with functions in the scope of modules."""
    page = browser.new_page()
    page.evaluate(f"{BYTES} {script(names)} {functions} null;")
    yield page
    page.close()


def run(page: "Page", names: tuple[str, ...], function: str, arguments: list[Any]) -> Any:
    """Call a function in the scope of modules."""
    page.evaluate(f"{{ {script(names)}; window.run = {function}; }} null;")
    return page.evaluate("arguments_ => window.run(arguments_)", arguments)
