"""Shadertoy texts drawn on OSMesa."""

from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from support.paths import DEMO

SHADERTOY = TARGETS["shadertoy"]
INPUTS = "uniform vec3 iResolution; uniform float iTime; uniform vec4 iMouse; uniform int iFrame;\n"
MAIN = "out vec4 c; void main() { if (iResolution.x < 0.) discard; mainImage(c, gl_FragCoord.xy); }\n"
PROBE = """uniform sampler2D points; out vec4 c;
void main() { c = vec4(field(vec4(texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz, 1))); }
"""
SIZE = (144, 96)


@cache
def demo() -> Model:
    """Load the trained model."""
    return load(DEMO)


@cache
def literal_text(model: Model, shade: str) -> str:
    """Return a model's text with the fewest digits that keep its surface."""
    return SHADERTOY(model, "literal", shade=shade)


def draw(
    osmesa: Context,
    text: str,
    size: tuple[int, int],
    inputs: dict[str, object],
    points: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Draw desktop GLSL on OSMesa; returns (H, W, 4) float32, top row first.

    inputs: uniforms by name; the text may lack some of them. points: (H W, 3) for the sampler `points`.
    """
    with osmesa as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader="#version 330\n" + text)
        target = gl.framebuffer([gl.texture(size, 4, dtype="f4")])
        for name, value in inputs.items():
            if name in program:
                program[name] = value
        if points is not None:
            texture = gl.texture(size, 4, np.pad(points, ((0, 0), (0, 1))).astype("f4").tobytes(), dtype="f4")
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            texture.use(0)
        target.use()
        gl.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
        data = target.read(components=4, dtype="f4")
    return np.frombuffer(data, np.float32).reshape(size[1], size[0], 4)[::-1]


def picture(
    osmesa: Context,
    text: str,
    mouse: tuple[float, float, float, float] = (0, 0, 0, 0),
    time: float = 0.0,
    size: tuple[int, int] = SIZE,
) -> NDArray[np.int16]:
    """Draw a text as Shadertoy does; returns (H, W, 3), from 0 to 255. mouse: iMouse, in pixels; time: iTime."""
    inputs = {"iResolution": (*size, 1), "iTime": time, "iMouse": mouse, "iFrame": 0}
    return (draw(osmesa, INPUTS + text + MAIN, size, inputs)[..., :3].clip(0, 1) * 255).round().astype(np.int16)
