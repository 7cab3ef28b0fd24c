"""The web page, which loses its context of WebGL over and over."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser_time import descendants
from mplicits.bake.registry import TARGETS
from soak import Watch, grown, repeat
from support.browser import PATIENCE, chromium, visit
from support.random_model import random_model

LONGEST = 300.0
"""Seconds that one loss may take with all that follows; the browser is killed then."""
TOLD = 25
"""Losses after each of which their number is printed."""
FEWEST = 3
"""Looks through which a line is laid."""
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
    """Take the context from the page `count` times, give it back, and wait for the picture.

    Where the browser ends, or does not answer within `LONGEST`, the row tells it, with what was seen until then.
    """
    from playwright.sync_api import Error

    file, outcome, done = folder / "page.html", "", 0
    file.write_text(TARGETS["html"](random_model((4, 0))), encoding="utf-8")
    try:
        with chromium() as browser, visit(browser, file, (160, 160), script=COUNTING) as visited:
            with within(LONGEST):
                visited.still()
                session = visited.page.context.new_cdp_session(visited.page)

            def heap() -> float:
                with within(LONGEST):
                    session.send("HeapProfiler.collectGarbage")
                    return float(session.send("Runtime.getHeapUsage")["usedSize"])

            def objects() -> float:
                with within(LONGEST):
                    return float(visited.page.evaluate("window.alive"))

            def lose() -> None:
                nonlocal done
                with within(LONGEST):
                    visited.page.evaluate(LOSE)
                    visited.page.wait_for_selector("#message", state="hidden", timeout=PATIENCE)
                    visited.still()
                done += 1
                if done % TOLD == 0:
                    print(f"{done:,} contexts lost", file=sys.stderr, flush=True)

            alive, memory, end = Watch(objects), Watch(heap), ""
            try:
                repeat(lose, count, memory, alive)
            except Error as error:
                end = f"; ended after {done:,}: {str(error).splitlines()[0]}"
            if len(alive.times) < FEWEST:
                return f"too few to tell{end}"
            least, most = alive.range()
            outcome = f"the page's {grown(memory)}; {least:.0f} to {most:.0f} objects of WebGL; "
            outcome += f"{len(visited.said)} lines on the console{end}"
    except Error as error:
        # A browser that is gone cannot be closed either.
        return outcome or f"too few to tell; ended after {done:,}: {str(error).splitlines()[0]}"
    return outcome


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Kill the processes that this one has started where the block takes longer: what waits for them then fails.

    Playwright itself waits without end for what a page evaluates. Raises its Error.
    """
    from playwright.sync_api import Error

    late = threading.Event()

    def end() -> None:
        late.set()
        kill_descendants()

    limit = threading.Timer(seconds, end)
    limit.daemon = True
    limit.start()
    try:
        yield
    except Error:
        if late.is_set():
            raise Error(f"no answer from the browser within {seconds:.0f} s") from None
        raise
    finally:
        limit.cancel()


def kill_descendants() -> None:
    """Kill all processes that this one, or one of these, has started."""
    for process in descendants():
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
