"""The picture of a model that chats and social networks show beside a link to its page."""

import io

import numpy as np

from ..codegen.targets.uniforms import default
from ..model.kinds import MARK
from ..model.model import Model
from . import page
from .about import PREVIEW

QUALITY = 85
"""Quality of the JPEG, from 0 to 100: not every reader of links takes a WebP."""


def preview(model: Model) -> bytes:
    """Draw the first view of a model's page, in soft light before the page's dark background, as a JPEG."""
    from PIL import Image

    width, height = PREVIEW
    picture = Image.fromarray(_background(width, height)).convert("RGBA")
    shape = Image.fromarray(page.poster_pixels(model, height, "softbox"))
    picture.alpha_composite(shape, ((width - shape.width) // 2, (height - shape.height) // 2))
    data = io.BytesIO()
    picture.convert("RGB").save(data, "JPEG", quality=QUALITY, optimize=True, comment=MARK.encode())
    return data.getvalue()


def _background(width: int, height: int) -> np.ndarray:
    """Return glsl/functions/background.glsl with the default colors: (height, width, 3) uint8, top row first."""
    bottom, top = (np.array(default(f"background_{end}")) for end in ("bottom", "top"))
    x, y = (np.arange(width) + 0.5) / width, 1 - (np.arange(height)[:, None] + 0.5) / height
    rise = (y * y * (3 - 2 * y))[..., None]
    vignette = 1 - 0.35 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)[..., None]
    return np.asarray(np.round(255 * (bottom + (top - bottom) * rise) * vignette), np.uint8)
