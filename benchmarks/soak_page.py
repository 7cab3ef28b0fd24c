"""The web page, which loses its context of WebGL over and over."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from mplicits.codegen.targets.registry import TARGETS
from soak import Watch, grown, repeat
from support.browser import chromium, visit
from support.random_model import random_model

COUNTING = """window.alive = 0;
const context = WebGL2RenderingContext.prototype;
for (const kind of ["Texture", "Buffer", "Program", "Shader", "Framebuffer", "Renderbuffer", "VertexArray"]) {
    const create = context[`create${kind}`], remove = context[`delete${kind}`];
    context[`create${kind}`] = function (...of) { ++window.alive; return create.apply(this, of); };
    context[`delete${kind}`] = function (one) { window.alive -= one ? 1 : 0; return remove.call(this, one); };
}
addEventListener("webglcontextlost", () => { window.alive = 0; }, true);"""
"""Counts WebGL's objects; those of a context that is lost are gone."""
LOSE = """() => new Promise((done) => {
    const canvas = document.getElementById("view");
    const extension = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    canvas.addEventListener("webglcontextlost", () => setTimeout(() => {
        extension.restoreContext();
        done();
    }, 20), {once: true});
    extension.loseContext();
})"""


def losses(count: int, folder: Path) -> str:
    """Take the context from the page `count` times, give it back, and wait for the picture."""
    file = folder / "page.html"
    file.write_text(TARGETS["html"](random_model((4, 0))), encoding="utf-8")
    with chromium() as browser, visit(browser, file, (160, 160), script=COUNTING) as visited:
        visited.still()
        session = visited.page.context.new_cdp_session(visited.page)

        def heap() -> float:
            session.send("HeapProfiler.collectGarbage")
            return float(session.send("Runtime.getHeapUsage")["usedSize"])

        alive = Watch(lambda: float(visited.page.evaluate("window.alive")))
        memory = Watch(heap)

        def work() -> None:
            visited.page.evaluate(LOSE)
            visited.page.wait_for_selector("#message", state="hidden")
            visited.still()

        repeat(work, count, memory, alive)
        least, most = alive.range()
        said = len(visited.said)
    return f"the page's {grown(memory)}; {least:.0f} to {most:.0f} objects of WebGL; {said} lines on the console"
