"""Long Shadertoy texts have the softbox: the renderer's picture, and Phong shading by a setting."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets import shadertoy_text
from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shadertoy_text import SOFTBOX_SHARE
from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support.fitted_model import fitted_model
from support.random_model import random_model
from support.scene_models import SCENE, composed
from support.shadertoy import SHADERTOY, SIZE, demo, literal_text, picture

BALL = fitted_model((24, 64))
WHITE = (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)
OFF = 0.045
"""Largest difference, from 0 to 1, of 19 of 20 pixels; at silhouettes, a pixel's only sample may miss.

A short text has one disk of light for the floor, the renderer five smaller ones.
"""


def psnr(ours: NDArray[np.floating], theirs: NDArray[np.floating]) -> float:
    """Compare pictures with values from 0 to 1. Returns dB."""
    return float(-10 * np.log10(np.square(ours - theirs).mean()))


def compare(osmesa: Context, model: Model, elevation: float, least: float) -> None:
    """Assert that a text's softbox equals the renderer's by `least` dB, and not its Phong; both without colors."""
    text = literal_text(model, "softbox")
    for knob, value in (("BOTTOM", "vec3(1)"), ("TOP", "vec3(1)"), ("VIEW", f"vec2(30., {elevation:.1f})")):
        text = re.sub(rf"#define {knob} .*", f"#define {knob} {value}", text)
    text = re.sub(r"#define COLOR(\(c\))? .*", r"#define COLOR\1 vec3(.8, .74, .66)", text)
    ours = picture(osmesa, text) / 255
    renderer = Renderer(osmesa, bake(model))
    pictures = [
        renderer.render(SIZE, Camera(30, elevation), RenderOptions(shade=shading, background=WHITE, plain=True))
        for shading in ("softbox", "phong")
    ]
    renderer.release()
    softbox, phong = (image[..., :3] for image in pictures)
    assert np.percentile(np.abs(ours - softbox), 95) < OFF
    assert psnr(ours, softbox) > max(least, psnr(ours, phong) + 3)


@pytest.mark.slow
def test_softbox_equals_the_renderer_s(osmesa: Context) -> None:
    """A ball with few edges from below the floor, and a knot that shades itself from above."""
    compare(osmesa, BALL, -30.0, 34)
    compare(osmesa, demo(), 20.0, 28)


def test_a_scene_has_the_softbox(osmesa: Context, tmp_path: Path) -> None:
    """Three rough balls on a plate; at their edges, normals by differences differ."""
    compare(osmesa, composed(tmp_path, SCENE, widths=(8, 12)), 20.0, 24)


def test_a_setting_selects_phong(osmesa: Context) -> None:
    text = literal_text(BALL, "softbox")
    knob = "#define SOFTBOX 1"
    assert text.count(knob) == 1
    phong = picture(osmesa, literal_text(BALL, "phong"))
    np.testing.assert_array_equal(picture(osmesa, text.replace(knob, "#define SOFTBOX 0")), phong)
    assert np.abs(picture(osmesa, text) - phong).mean() > 2


@pytest.mark.parametrize("width", [16, 44])
def test_only_long_texts_have_softbox_by_default(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadertoy_text, "savings", lambda *_: shadertoy_text.Savings())
    model = random_model((width, 2), (width, 2))
    default, phong, softbox = (SHADERTOY(model, "literal", 7, shade=shade) for shade in (None, "phong", "softbox"))
    assert "SOFTBOX" not in phong
    assert "#define SOFTBOX 1" in softbox
    allowed = len(softbox) <= (1 + SOFTBOX_SHARE) * len(phong)
    assert allowed == (width == 44)
    assert default == (softbox if allowed else phong)
