"""Tiny pages in a browser: when they have drawn, and their picture."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .browser import Visit

COUNT = """{
    const request = requestAnimationFrame, old = matchMedia;
    window.waiting = 0;
    window.requestAnimationFrame = (draw) => (++waiting, request((now) => (--waiting, draw(now))));
    window.matchMedia = (query) => (query.includes("motion") ? {matches: true} : old(query));
}"""
"""Script for `visit`: counts the frames that wait for the browser, and asks for less motion."""
STILL = "document.querySelector('canvas') && waiting === 0"


def still(visited: Visit) -> NDArray[np.int16]:
    """Wait until nothing more is drawn, and return the picture (H, W, 3)."""
    visited.until(STILL)
    return np.asarray(Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB"), np.int16)
