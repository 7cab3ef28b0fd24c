"""Tiny pages in a browser: when they have drawn, and their picture."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .browser import Visit

COUNT = """{
    const request = requestAnimationFrame, old = matchMedia;
    const context = WebGL2RenderingContext.prototype, {blitFramebuffer, scissor} = context;
    window.asked = window.waiting = window.coarse = window.first = 0;
    context.scissor = function (...values) { first ||= values[2] * values[3]; return scissor.apply(this, values); };
    context.blitFramebuffer = function (...values) { ++coarse; return blitFramebuffer.apply(this, values); };
    window.requestAnimationFrame = (draw) => (++asked, ++waiting, request((now) => (--waiting, draw(now))));
    window.matchMedia = (query) => (query.includes("motion") ? {matches: true} : old(query));
}"""
"""Script for `visit`: counts the frames that the page asked for, those that it waits for, its coarse pictures, and the
pixels of the first; prefers less motion."""
MOVES = "coarse > 12"
"""Whether the view or the model moves: the page draws a few coarse pictures of a view at rest."""


def asked(visited: Visit) -> int:
    """Return how many frames the page asked for."""
    return int(visited.page.evaluate("asked"))


def still(visited: Visit, before: int = 0) -> NDArray[np.int16]:
    """Wait until the page asked for more frames than `before`, and draws no more; return the picture (H, W, 3)."""
    visited.until(f"asked > {before} && waiting === 0")
    return np.asarray(Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB"), np.int16)
