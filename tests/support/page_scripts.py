"""Runs functions in the scope of the studio's modules, in Chromium."""

import base64
from typing import TYPE_CHECKING, Any

import numpy as np

from mplicits.web.bundle import modules, script

if TYPE_CHECKING:
    from playwright.sync_api import Page

TRAINING = tuple(name for name in modules("training.js", "workers.js", "model_file.js") if name != "facts.js")
"""Modules that train a shape and write its file, for a page without facts."""
BYTES = """window.bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;"""
"""Defines the inverse of `packed`, in the page."""


def packed(array: np.ndarray) -> str:
    """Return an array's bytes, to pass them to a page."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def run(page: "Page", names: tuple[str, ...], function: str, arguments: list[Any]) -> Any:
    """Call a function in the scope of modules."""
    page.evaluate(f"{{ {script(names)}; window.run = {function}; }} null;")
    return page.evaluate("arguments_ => window.run(arguments_)", arguments)
