"""The model of the page's tests, and pictures of the page and of the desktop's renderer compared."""

from dataclasses import replace

import numpy as np
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from numpy.typing import NDArray

from support.fitted_model import fitted_model

MODEL = fitted_model((20, 32))
SIDE = 128
"""Pixels of the page's canvas in a window of 640 x 640 CSS pixels (browser.visit)."""
OFF, FEW, MEAN = 24, 0.005, 0.6
"""Page against OSMesa, both with 16 samples a pixel: a channel is off beyond so many of 255, so few pixels may be, mean
difference allowed. The samples lie elsewhere in the pixel, which shows on silhouettes; the page dithers its 8 bits."""


def desktop(renderer: Renderer, camera: Camera, options: RenderOptions) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 3), 16 samples a pixel."""
    image = renderer.render((SIDE, SIDE), camera, replace(options, samples=16))
    pixels: NDArray[np.uint8] = np.rint(image[..., :3].clip(0, 1) * 255).astype(np.uint8)
    return pixels


def differ(ours: NDArray[np.uint8], theirs: NDArray[np.uint8]) -> bool:
    assert ours.shape == theirs.shape
    difference = np.abs(ours.astype(int) - theirs)
    return bool((difference.max(axis=-1) > OFF).mean() > FEW or difference.mean() > MEAN)
