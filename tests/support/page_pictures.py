"""The model of the page's tests, and the comparison of the page's pictures with the desktop renderer's."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.page import poster_pixels
from support.fitted_model import fitted_model

MODEL = fitted_model((20, 32))
SIDE = 128
"""Pixels along each side of the page's canvas, in a window of 640 x 640 CSS pixels (browser.visit)."""

# Tolerances for two pictures with 16 samples a pixel. Page and desktop place samples differently inside a pixel, which
# matters on silhouettes, and the page dithers its 8 bits.
CHANNEL_TOLERANCE = 24
"""Largest difference, of 255, of an equal pixel."""
MOST_DIFFERENT = 0.005
"""Largest share of different pixels."""
MEAN_TOLERANCE = 0.6
"""Largest mean difference, of 255."""


def remembering(model: Model, storage: str) -> str:
    """Return a script that stores "texture", "literal" or "trying" for a model (web/draw/remembered_variant.js)."""
    return f"localStorage.setItem('mplicits {model.sha256()}', '{storage}');"


def use_small_posters(patch: pytest.MonkeyPatch) -> None:
    """Let pages have posters of 16 x 16 pixels: one of the usual size takes a second."""
    patch.setattr("mplicits.web.page.poster_pixels", lambda model, _side, shade: poster_pixels(model, 16, shade))


def desktop(renderer: Renderer, camera: Camera, options: RenderOptions, side: int = SIDE) -> NDArray[np.uint8]:
    """Return the desktop's picture, (side, side, 3) with 16 samples a pixel."""
    image = renderer.render((side, side), camera, replace(options, samples=16))
    pixels: NDArray[np.uint8] = np.rint(image[..., :3].clip(0, 1) * 255).astype(np.uint8)
    return pixels


def differ(ours: NDArray[np.uint8], theirs: NDArray[np.uint8], mean: float = MEAN_TOLERANCE) -> bool:
    """Whether two pictures (H, W, 3) differ beyond the tolerances. mean: largest mean difference, of 255."""
    assert ours.shape == theirs.shape
    difference = np.abs(ours.astype(int) - theirs)
    different = (difference.max(axis=-1) > CHANNEL_TOLERANCE).mean()
    return bool(different > MOST_DIFFERENT or difference.mean() > mean)
