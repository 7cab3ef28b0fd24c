"""Other players draw Shadertoy texts like OSMesa."""

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from mplicits.codegen.targets.motion import PERIOD
from mplicits.model import quantize
from mplicits.viewer.draw.context import Context
from support.browser import visit
from support.fitted_model import fitted_model
from support.moving_model import moving_model
from support.random_model import random_model
from support.shadertoy import INPUTS, MAIN, SHADERTOY, SIZE, literal_text, picture
from support.shadertoy_player import player_picture

if TYPE_CHECKING:
    from playwright.sync_api import Browser

WEBGL = f"""<body style="margin: 0"><canvas width={SIZE[0]} height={SIZE[1]}></canvas><script>
const gl = document.querySelector("canvas").getContext("webgl2", {{preserveDrawingBuffer: true}});
const program = gl.createProgram();
const vertex = `#version 300 es
void main() {{ gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }}`;
for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, THE_TEXT]]) {{
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) console.log(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
}}
gl.linkProgram(program);
gl.useProgram(program);
gl.uniform3f(gl.getUniformLocation(program, "iResolution"), {SIZE[0]}, {SIZE[1]}, 1);
gl.drawArrays(gl.TRIANGLES, 0, 3);
gl.finish();
window.done = true;
</script>"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["packed", "moving", "softbox"])
def test_another_shadertoy_player_draws_the_same(kind: str, osmesa: Context, tmp_path: Path) -> None:
    """The moving model is at time 0.5 after a quarter of its period."""
    if kind == "packed":
        text = SHADERTOY(quantize.quantized_model(random_model((16, 1), (8, 0))), "packed")
    elif kind == "softbox":
        text = literal_text(fitted_model((24, 64)), "softbox")
    else:
        text = SHADERTOY(moving_model(), "literal")
        assert np.abs(picture(osmesa, text, time=0.4) - picture(osmesa, text, time=2.4)).max(-1).mean() > 3
    time = PERIOD / 4 if kind == "moving" else 0.0
    theirs = player_picture(text, SIZE, tmp_path, time)
    difference = np.abs(picture(osmesa, text, time=time) - theirs).max(-1)
    assert (difference > 4).mean() < 0.005


@pytest.mark.slow
def test_chromium_draws_the_same(osmesa: Context, browser: "Browser", tmp_path: Path) -> None:
    """Chromium draws by WebGL2 on SwiftShader, whose sine is off by 2e-4."""
    text = SHADERTOY(quantize.quantized_model(random_model((16, 1), (8, 0))), "packed", shade="softbox")
    fragment = "#version 300 es\nprecision highp float; precision highp int;\n" + INPUTS + text + MAIN
    (tmp_path / "player.html").write_text(WEBGL.replace("THE_TEXT", json.dumps(fragment)))
    with visit(browser, tmp_path / "player.html", SIZE, share=1) as visited:
        visited.until("window.done")
        assert not visited.console
        theirs = np.asarray(Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB"), np.int16)
    difference = np.abs(picture(osmesa, text) - theirs).max(-1)
    assert (difference > 8).mean() < 0.01
