"""Evaluates the GLSL functions of a model's field at some thousand points."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.targets import glsl330
from mplicits.model.model import Model
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context

SIDE = 64
PROBE = """
uniform sampler2D points;
uniform int output_kind;
void main() {
    if (resolution.x < 0.0) discard;
    vec3 p = texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz;
    int reached;
    float f = field(p, level, reached);
    color = output_kind == 0 ? field_gradient(p, level) : output_kind == 1 ? vec4(f, float(reached), 0, 0)
        : vec4(albedo(p), 0);
}
"""


def points() -> NDArray[np.float32]:
    return np.random.default_rng(2).uniform(-1, 1, (SIDE * SIDE, 3)).astype(np.float32)


class FieldProbe:
    """The GLSL functions of a model, which a call evaluates at points()."""

    def __init__(self, osmesa: Context, model: Model, storage: str) -> None:
        self.context, shader = osmesa, glsl330.bake(model, storage, main=PROBE)
        self.narrow = shader.narrow
        with osmesa as gl:
            self.program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=shader.text)
            texels = np.concatenate([points(), points()[:, :1]], axis=1)
            self.textures = {"points": gl.texture((SIDE, SIDE), 4, texels.tobytes(), dtype="f4")}
            if shader.weights is not None:
                height, width, _ = shader.weights.shape
                self.textures["weights"] = gl.texture((width, height), 4, shader.weights.tobytes(), dtype="f4")
            self.target = gl.framebuffer([gl.texture((SIDE, SIDE), 4, dtype="f4")])
            self.triangle = gl.vertex_array(self.program, [])

    def __call__(self, level: int, kind: int) -> NDArray[np.float32]:
        """Return four numbers for each of points(), (N, 4) float32.

        kind: 0 for the gradient of f_level and f_level, 1 for the value of the finest defined level and that level, 2
        for the color.
        """
        with self.context:
            for unit, (name, texture) in enumerate(self.textures.items()):
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
                texture.use(unit)
                self.program[name] = unit
            self.program["level"] = level
            self.program["output_kind"] = kind
            self.target.use()
            self.triangle.render(moderngl.TRIANGLES, vertices=3)
            data = self.target.read(components=4, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(-1, 4)


def assert_close(ours: NDArray[np.float32], expected: NDArray[np.float32]) -> None:
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-5 * float(np.abs(expected).max()))
