"""Supersampling: positions of samples, and Python's sRGB against the shaders'."""

import moderngl
import numpy as np
import pytest

from mplicits import glsl
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.framebuffer import free, read_pixels
from mplicits.viewer.draw.supersampling import Image, from_linear, jitters, to_linear

RAMP = np.linspace(-0.25, 1.25, 1501, dtype=np.float32)
"""Channel values, also outside [0, 1] and on both sides of the bend near 0."""


def by_shader(context: Context, file: str, function: str, image: Image) -> Image:
    """Apply a function vec3 -> vec3 of a file in glsl/ to the colors of an image (H, W, 4); alpha becomes 1."""
    height, width, _ = image.shape
    fragment = (
        f"#version 330\nuniform sampler2D image;\nout vec4 color;\n{glsl.load(file)}"
        f"void main() {{ color = vec4({function}(texelFetch(image, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }}"
    )
    with context as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=fragment)
        triangle = gl.vertex_array(program, [])
        texture = gl.texture((width, height), 4, image.tobytes(), dtype="f4")
        target = gl.framebuffer([gl.texture((width, height), 4, dtype="f4")])
        texture.use(0)
        target.use()
        triangle.render(moderngl.TRIANGLES, vertices=3)
        result = read_pixels(target, (width, height)).copy()
        free(target)
        for resource in (texture, triangle, program):
            resource.release()
    return result


@pytest.fixture
def image() -> Image:
    """The ramp in three channels, each shifted."""
    return np.stack([RAMP, RAMP[::-1], np.roll(RAMP, 700), np.ones_like(RAMP)], axis=-1)[None]


def test_decoding_matches_the_shaders(osmesa: Context, image: Image) -> None:
    np.testing.assert_allclose(
        to_linear(image, transparent=False), by_shader(osmesa, "linear.glsl", "linear", image), atol=1e-5
    )


def test_encoding_matches_the_shaders(osmesa: Context, image: Image) -> None:
    in_range = np.clip(image, 0, 1)
    np.testing.assert_allclose(
        from_linear(in_range, transparent=False), by_shader(osmesa, "srgb.glsl", "srgb", image), atol=1e-5
    )


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 16, 64])
def test_jitters_are_spread_over_the_pixel(samples: int) -> None:
    offsets = jitters(samples)
    assert offsets.shape == (samples, 2)
    np.testing.assert_allclose(offsets.mean(axis=0), 0, atol=1e-6)
    for axis in offsets.T:
        np.testing.assert_array_equal(np.sort(np.floor((axis + 0.5) * samples)), np.arange(samples))
