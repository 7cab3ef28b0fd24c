"""Runs the texts of function targets at some thousand points.

Each runner takes the texts, statements that compute 8 numbers at a point p and the time `time`, points (COUNT, 3), a
folder for files, and an OpenGL context; it returns (COUNT, 8). Shaders store the numbers in the vectors a and b, with
the vector n to spare; C in the array r.
"""

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from support import needs
from support.compilers import check_c, check_hlsl, webgpu

Array = NDArray[np.float32]
COUNT = 4096
TIME = 0.6


def in_glsl(texts: str, statements: str, points: Array, _: Path, osmesa: Context) -> Array:
    main = f"""
uniform sampler2D points; uniform int half_; out vec4 color;
void main() {{
    vec3 p = texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz, n, c; vec4 a, b; float time = {TIME};
    {statements.replace("FOUR", "vec4")}
    color = half_ == 0 ? a : b;
}}"""
    with osmesa as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader="#version 330\n" + texts + main)
        texels = np.concatenate([points, points[:, :1]], axis=1).tobytes()
        gl.texture((64, 64), 4, texels, dtype="f4").use(0)
        target, results = gl.framebuffer([gl.texture((64, 64), 4, dtype="f4")]), []
        for half in (0, 1):
            program["half_"] = half
            target.use()
            gl.vertex_array(program, []).render(vertices=3)
            results.append(np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(-1, 4))
    return np.concatenate(results, axis=1)


def computed(shader: Any, points: Array) -> Array:
    """Run a compute shader of WebGPU, in WGSL or SPIR-V, at points (COUNT, 3). Returns (COUNT, 8)."""
    webgpu()
    compute = needs.package("wgpu.utils.compute")
    buffers = {0: np.ascontiguousarray(points)}
    out = compute.compute_with_buffers(buffers, {1: (8 * COUNT, "f")}, shader, n=(COUNT // 64, 1, 1))
    return np.frombuffer(out[1], np.float32).reshape(COUNT, 8)


def in_wgsl(texts: str, statements: str, points: Array, *_: object) -> Array:
    main = f"""
@group(0) @binding(0) var<storage, read> points: array<f32>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) at: vec3u) {{
    let i = at.x; let p = vec3f(points[3 * i], points[3 * i + 1], points[3 * i + 2]); let time = f32({TIME});
    var n: vec3f; var c: vec3f; var a: vec4f; var b: vec4f;
    {statements.replace("FOUR", "vec4f")}
    for (var k = 0u; k < 4u; k++) {{ results[8 * i + k] = a[k]; results[8 * i + 4 + k] = b[k]; }}
}}"""
    return computed(texts + main, points)


def in_hlsl(texts: str, statements: str, points: Array, folder: Path, _: Context) -> Array:
    main = f"""
[[vk::binding(0, 0)]] StructuredBuffer<float> points;
[[vk::binding(1, 0)]] RWStructuredBuffer<float> results;
[numthreads(64, 1, 1)] void main(uint3 at : SV_DispatchThreadID) {{
    uint i = at.x; float3 p = float3(points[3 * i], points[3 * i + 1], points[3 * i + 2]), n, c; float4 a, b;
    float time = {TIME};
    {statements.replace("FOUR", "float4")}
    for (uint k = 0; k < 4; k++) {{ results[8 * i + k] = a[k]; results[8 * i + 4 + k] = b[k]; }}
}}"""
    return computed(check_hlsl(texts + main, folder, "comp"), points)


def in_c(texts: str, statements: str, points: Array, folder: Path, _: Context) -> Array:
    main = f"""
#include <stdio.h>
int main(void) {{
    float p[3], r[8], time = {TIME}f;
    while (fread(p, 4, 3, stdin) == 3) {{
        (void)time;
        {statements}
        fwrite(r, 4, 8, stdout);
    }}
    return 0;
}}"""
    check_c(texts + main, folder, "-std=c99", "-O1", "-o", "f")
    done = subprocess.run([str(folder / "f")], input=points.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.float32).reshape(-1, 8)
