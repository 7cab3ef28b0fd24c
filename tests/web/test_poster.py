"""The small picture that travels in a page is what the shaders draw there first."""

import base64
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.uniforms import OPENING_SHADES
from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web import page as webpage
from support.fitted_model import fitted_model

MODEL = fitted_model((20, 32))
BACKDROP = 0.4
LARGEST_ERROR = 0.011
"""Root mean square error of a poster, most of which is WebP's."""


def poster_of(page: str) -> np.ndarray:
    """Decode the poster of a page: (side, side, 4) in [0, 1]."""
    found = re.search(r'src="data:image/webp;base64,([^"]+)"', page)
    assert found
    data = base64.b64decode(found[1])
    assert len(data) < 6000
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"), np.float64) / 255


@pytest.mark.parametrize(
    "model",
    [replace(MODEL, front=(215.0, 15.0)), replace(MODEL, texture=None)],
    ids=["with colours, from its front", "plain, from the usual place"],
)
@pytest.mark.parametrize("shade", OPENING_SHADES)
def test_the_poster_is_the_first_picture(model: Model, shade: str, osmesa: Context) -> None:
    poster = poster_of(webpage.standalone(model, shade=shade))
    side = len(poster)
    renderer = Renderer(osmesa, glsl330.bake(model))

    def error(camera: Camera) -> float:
        options = RenderOptions(shade=shade, samples=4, transparent=True)
        drawn = renderer.render((side, side), camera, options).astype(np.float64)
        over = [BACKDROP * (1 - image[..., 3:]) + image[..., 3:] * image[..., :3] for image in (poster, drawn)]
        return float(np.sqrt(np.mean((over[0] - over[1]) ** 2)))

    camera = Camera(*(model.front or ()))
    assert error(camera) < LARGEST_ERROR
    assert error(camera.orbited(8, 0)) > LARGEST_ERROR, "the tolerance tells another view apart"
    renderer.release()
