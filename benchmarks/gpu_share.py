"""The share of a card that fragment shaders get: one loop as a fragment shader and as a compute shader of OpenGL."""

import statistics
import time
from collections.abc import Callable

import moderngl

from mplicits.viewer.draw.context import EGL_DEVICES, EGL_LIBRARY

LOOP = """#version 430
uniform int turns;
float looped(vec2 start) {
    float x = start.x;
    for (int i = 0; i < turns; ++i) x = sin(x * 1.7 + start.y);
    return x;
}
"""
VERTEX = """#version 430
void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }
"""
FRAGMENT = f"""{LOOP}
out float found;
void main() {{ found = looped(gl_FragCoord.xy * 1e-3); }}
"""
COMPUTE = f"""{LOOP}
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Found {{ float found[]; }};
uniform int side;
void main() {{
    uint at = gl_GlobalInvocationID.x;
    found[at] = looped((vec2(at % side, at / side) + 0.5) * 1e-3);
}}
"""
ROUNDS, REPEATS = 5, 8
"""Timed rounds, and runs of each."""


def fragment_share(side: int, turns: int) -> dict[str, object]:
    """Time the loop at side x side points. Returns the medians in ms, their ratio and the largest difference.

    The ratio is by the wall clock; llvmpipe's queries leave out compute shaders. Returns {"missing": why} where OpenGL
    has no compute shaders. side: a multiple of 8.
    """
    gl = context()
    if gl is None:
        return {"missing": "EGL gives no context of OpenGL 4.3, which has compute shaders"}
    with gl:
        target = gl.framebuffer([gl.texture((side, side), 1, dtype="f4")])
        found = gl.buffer(reserve=4 * side * side)
        drawing = gl.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        computing = gl.compute_shader(COMPUTE)
        drawing["turns"] = computing["turns"] = turns
        computing["side"] = side
        triangle = gl.vertex_array(drawing, [])
        target.use()
        found.bind_to_storage_buffer(0)

        def timed(work: Callable[[], object]) -> tuple[float, float]:
            """Return the median seconds of one run, by the wall clock and by a query."""
            times = []
            for _ in range(ROUNDS + 1):
                gl.finish()
                query, began = gl.query(time=True), time.perf_counter()
                with query:
                    for _ in range(REPEATS):
                        work()
                gl.finish()
                times.append(((time.perf_counter() - began) / REPEATS, query.elapsed / 1e9 / REPEATS))
            wall, queried = (statistics.median(column) for column in zip(*times[1:], strict=True))
            return wall, queried

        fragment = timed(lambda: triangle.render(moderngl.TRIANGLES, vertices=3))
        compute = timed(lambda: computing.run(side * side // 64))
        pairs = zip(
            memoryview(target.read(components=1, dtype="f4")).cast("f"), memoryview(found.read()).cast("f"), strict=True
        )
        difference = max(abs(one - other) for one, other in pairs)
    gl.release()
    return {
        "fragment_ms": 1e3 * fragment[0],
        "compute_ms": 1e3 * compute[0],
        "share": compute[0] / fragment[0],
        "share_by_queries": compute[1] / fragment[1],
        "largest_difference": difference,
    }


def context() -> moderngl.Context | None:
    """Open a context of OpenGL 4.3 through EGL; None where no device gives one."""
    for device in range(EGL_DEVICES):
        try:
            settings = {"backend": "egl", "libegl": EGL_LIBRARY, "libgl": EGL_LIBRARY, "device_index": device}
            return moderngl.create_context(430, standalone=True, **settings)  # type: ignore[arg-type]
        except Exception:  # glcontext raises bare Exception
            continue
    return None
