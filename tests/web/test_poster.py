"""The poster of a page equals the first picture of the shaders."""

import base64
import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from mplicits.codegen.targets import glsl330
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
"""Largest root mean square error of a poster; most of it is WebP's."""


def decoded(url: str) -> np.ndarray:
    """Decode a poster: (side, side, 4) in [0, 1]."""
    data = base64.b64decode(url.removeprefix("data:image/webp;base64,"))
    assert len(data) < 6000
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"), np.float64) / 255


@pytest.mark.parametrize(
    ("shade", "model"),
    [("phong", replace(MODEL, texture=None)), ("softbox", replace(MODEL, front=(215.0, 15.0)))],
    ids=["phong, plain, from the usual place", "studio, with colors, from its front"],
)
def test_the_poster_is_the_first_picture(shade: str, model: Model, osmesa: Context) -> None:
    poster = decoded(webpage.poster_url(model, shade))
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
