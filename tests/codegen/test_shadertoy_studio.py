"""Shadertoy texts that are long enough have the studio: the viewer's picture, and Phong's by a knob."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shadertoy_text import STUDIO_SHARE
from mplicits.model import quantise
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support.fitted_model import fitted_model
from support.paths import DEMO
from support.random_model import random_model
from support.scene_models import SCENE, composed
from support.shadertoy import SHADERTOY, SIZE, picture

WHITE = (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)
ELEVATIONS = 20.0, -30.0
"""Degrees, of views from above the floor and from below."""
OFF = 0.03
"""Of 1: 19 of 20 pixels differ by less; at silhouettes, the one sample of a pixel may miss."""


@pytest.fixture(scope="module")
def demo() -> Model:
    return load(DEMO)


def psnr(ours: NDArray[np.floating], theirs: NDArray[np.floating]) -> float:
    """Compare pictures of values from 0 to 1. Returns dB."""
    return float(-10 * np.log10(np.square(ours - theirs).mean()))


def compare(osmesa: Context, model: Model, elevation: float, least: float) -> None:
    """Assert that a text's studio is the renderer's by `least` dB, and not its Phong; both without colours."""
    text = SHADERTOY(model, "literal", shade="studio")
    for knob, value in (("BOTTOM", "vec3(1)"), ("TOP", "vec3(1)"), ("VIEW", f"vec2(30., {elevation:.1f})")):
        text = re.sub(rf"#define {knob} .*", f"#define {knob} {value}", text)
    text = re.sub(r"#define COLOUR(\(c\))? .*", r"#define COLOUR\1 vec3(.8, .74, .66)", text)
    ours = picture(osmesa, text) / 255
    renderer = Renderer(osmesa, bake(model))
    pictures = [
        renderer.render(SIZE, Camera(30, elevation), RenderOptions(shade=shading, background=WHITE, plain=True))
        for shading in ("studio", "phong")
    ]
    renderer.release()
    studio, phong = (image[..., :3] for image in pictures)
    assert np.percentile(np.abs(ours - studio), 95) < OFF
    assert psnr(ours, studio) > max(least, psnr(ours, phong) + 3)


@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_it_is_the_renderer_s_studio(osmesa: Context, demo: Model, elevation: float) -> None:
    """A ball of few edges, and a knot that shades itself."""
    compare(osmesa, fitted_model((24, 64)), elevation, 34)
    compare(osmesa, demo, elevation, 28)


def test_a_scene_has_it_too(osmesa: Context, tmp_path: Path) -> None:
    """Three rough balls on a plate, with edges at which normals by differences are others."""
    compare(osmesa, composed(tmp_path, SCENE, widths=(8, 12)), ELEVATIONS[0], 24)


def test_a_knob_makes_it_phong(osmesa: Context, demo: Model) -> None:
    text = SHADERTOY(demo, "literal", shade="studio")
    knob = "#define STUDIO 1"
    assert text.count(knob) == 1
    phong = picture(osmesa, SHADERTOY(demo, "literal", shade="phong"))
    np.testing.assert_array_equal(picture(osmesa, text.replace(knob, "#define STUDIO 0")), phong)
    assert np.abs(picture(osmesa, text) - phong).mean() > 2


@pytest.mark.parametrize("width", [16, 64])
def test_long_texts_have_it_where_nothing_is_said(width: int) -> None:
    model = quantise.quantised_model(random_model((width, 2), (width, 2)))
    default, phong, studio = (SHADERTOY(model, "packed", shade=shade) for shade in (None, "phong", "studio"))
    assert "STUDIO" not in phong
    assert "#define STUDIO 1" in studio
    allowed = len(studio) <= (1 + STUDIO_SHARE) * len(phong)
    assert allowed == (width == 64)
    assert default == (studio if allowed else phong)
