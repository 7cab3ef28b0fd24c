"""Software OpenGL (llvmpipe) limits the loop iterations of a fragment, and the renderer respects the limit."""

import numpy as np
import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shader import LEAST_STEPS, LOOP_LIMIT, Shader
from mplicits.model.errors import UserError
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.loop_limit import schedule_that_fits
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support import needs
from support.random_model import random_model


def test_llvmpipe_stops_at_the_loop_limit(osmesa: Context) -> None:
    """A loop beyond the limit ends early without an error, which is why `schedule_that_fits` exists."""
    if not osmesa.software:
        needs.lack("OSMesa in software")
    with osmesa as gl:
        program = gl.program(
            vertex_shader=VERTEX_SHADER,
            fragment_shader="#version 330\nuniform int most; out vec4 color;\n"
            "void main() { float n = 0.; for (int i = 0; i < most; ++i) n += 1.; color = vec4(n); }",
        )
        target = gl.framebuffer([gl.texture((1, 1), 4, dtype="f4")])
        target.use()
        counts = {}
        for most in (LOOP_LIMIT - 5, LOOP_LIMIT + 5):
            program["most"] = most
            gl.vertex_array(program, []).render(vertices=3)
            counts[most] = int(np.frombuffer(target.read(components=4, dtype="f4"), np.float32)[0])
    assert counts[LOOP_LIMIT - 5] == LOOP_LIMIT - 5
    assert counts[LOOP_LIMIT + 5] < LOOP_LIMIT + 5


def wide(loops: int) -> Shader:
    """Return a shader whose second level takes `loops` loop iterations per value, and twice as many per gradient."""
    return Shader("", None, (0, loops), (0, 2 * loops), 0, (20, 5), (0.1, 0.01))


def test_the_last_level_s_steps_and_then_the_rounds_are_reduced_to_fit() -> None:
    shader = wide(2000)
    steps, rounds = schedule_that_fits(shader, 2, 2, (20, 5), 32, "plain")
    assert steps == (20, LEAST_STEPS)
    assert 1 <= rounds < 32
    assert shader.worst_loops(2, 2, steps, rounds, "plain") <= LOOP_LIMIT
    assert shader.worst_loops(2, 2, steps, rounds + 1, "plain") > LOOP_LIMIT
    assert schedule_that_fits(shader, 2, 2, (20, 1), 32, "plain")[0] == (20, 1)
    assert schedule_that_fits(wide(10), 2, 2, (20, 5), 8, "plain") == ((20, 5), 8)
    with pytest.raises(UserError, match="--iterations"):
        schedule_that_fits(wide(30_000), 2, 2, (20, 5), 8, "plain")


def test_the_renderer_respects_the_limit(osmesa: Context) -> None:
    renderer = Renderer(osmesa, bake(random_model((16, 1), (16, 1)), "texture"))
    many = RenderOptions(rounds=1000)
    assert 1 < renderer.schedule(many)[1] < renderer.wanted_rounds(many) == 1000
    assert renderer.schedule(RenderOptions()) == ((20, 5), renderer.wanted_rounds(RenderOptions()))
    with pytest.raises(UserError, match="loop iterations"):
        renderer.render((4, 4), Camera(), RenderOptions(schedule="plain", iterations=(10_000, 20)))
    renderer.release()
