"""Other players draw Shadertoy texts like OSMesa."""

import importlib.util
import io
import json
import os
import subprocess
import sys
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
PLAYER = """
import sys
from wgpu_shadertoy import Shadertoy
from PIL import Image
text, size, output = open(sys.argv[1]).read(), tuple(map(int, sys.argv[2].split("x"))), sys.argv[3]
drawn = Shadertoy(text, resolution=size).snapshot(float(sys.argv[4]))
Image.frombytes("RGBA", size, bytes(drawn)).convert("RGB").save(output)
"""


@pytest.mark.skipif(importlib.util.find_spec("wgpu_shadertoy") is None, reason="wgpu-shadertoy is not installed")
def test_another_shadertoy_player_draws_the_same(osmesa: Context, tmp_path: Path) -> None:
    """The moving model is at time 0.5 after a quarter of its period."""
    packed = SHADERTOY(quantize.quantized_model(random_model((16, 1), (8, 0))), "packed")
    moving = SHADERTOY(moving_model(), "literal")
    assert np.abs(picture(osmesa, moving, time=0.4) - picture(osmesa, moving, time=2.4)).max(-1).mean() > 3
    texts = [
        (packed, 0.0),
        (literal_text(fitted_model((24, 64)), "studio"), 0.0),
        (moving, PERIOD / 4),
    ]
    for text, time in texts:
        (tmp_path / "text.frag").write_text(text)
        command = [sys.executable, "-c", PLAYER, "text.frag", "x".join(map(str, SIZE)), "player.png", str(time)]
        player = subprocess.run(
            command,
            cwd=tmp_path,
            env={**os.environ, "WGPU_FORCE_OFFSCREEN": "true"},
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
        )
        if "adapter" in player.stderr.lower() and player.returncode:
            pytest.skip("no Vulkan driver (Debian: mesa-vulkan-drivers)")
        assert player.returncode == 0, player.stderr
        theirs = np.asarray(Image.open(tmp_path / "player.png"), np.int16)
        difference = np.abs(picture(osmesa, text, time=time) - theirs).max(-1)
        assert (difference > 4).mean() < 0.005, time


def test_chromium_draws_the_same(osmesa: Context, browser: "Browser", tmp_path: Path) -> None:
    """Chromium draws by WebGL2 on SwiftShader, whose sine is off by 2e-4."""
    text = SHADERTOY(quantize.quantized_model(random_model((16, 1), (8, 0))), "packed", shade="studio")
    fragment = "#version 300 es\nprecision highp float; precision highp int;\n" + INPUTS + text + MAIN
    (tmp_path / "player.html").write_text(WEBGL.replace("THE_TEXT", json.dumps(fragment)))
    with visit(browser, tmp_path / "player.html", SIZE, share=1) as visited:
        visited.until("window.done")
        assert not visited.console
        theirs = np.asarray(Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB"), np.int16)
    difference = np.abs(picture(osmesa, text) - theirs).max(-1)
    assert (difference > 8).mean() < 0.01
