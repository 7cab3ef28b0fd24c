"""The same work over and over, and what a process holds of memory and of OpenGL's objects meanwhile."""

import ctypes
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from mplicits.codegen.targets import glsl330
from mplicits.model.model_file import load, save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.osmesa import OSMesa
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.state.source import open_source
from support.display import virtual_display
from support.random_model import random_model

SKIPPED = 0.3
"""Share of the looks that are not counted: caches fill."""
TYPES = ("Texture", "Buffer", "Program", "Shader", "Framebuffer", "Renderbuffer", "VertexArray")
LEAST_NAMES = 4096
"""So many names at the least, from 1 on, are asked of the driver: whether they are objects."""
VERTEX_SHADER = 0x8B31
LOOKS = 200
"""Looks at most in one run."""
STRETCH = 5
"""Rounds of a window's loop after each new size."""
SIDE = 64
"""Pixels along each side of the window."""
PICTURE = (32, 32)
START = """
import time
before = time.process_time()
from mplicits.__main__ import end_imports_at_once
end_imports_at_once()
print(before, time.process_time() - before)
"""


def resident(process: str = "self") -> int:
    """Return the resident memory of a process, in bytes."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * resource.getpagesize()


def objects(address: Callable[[str], int]) -> int:
    """Count the objects that an OpenGL context holds, which is current. address: finds a function by its name."""
    count = 0
    for kind in TYPES:
        is_one = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(address(f"glIs{kind}"))
        count += sum(bool(is_one(name)) for name in range(1, max(LEAST_NAMES, newest(address, kind))))
    return count


def newest(address: Callable[[str], int], kind: str) -> int:
    """Make an object of a kind and delete it; return its name. Mesa counts names up, and takes none a second time."""
    name = ctypes.c_uint()
    if kind in ("Program", "Shader"):
        arguments = [VERTEX_SHADER] if kind == "Shader" else []
        make = ctypes.CFUNCTYPE(ctypes.c_uint, *[ctypes.c_uint] * len(arguments))(address(f"glCreate{kind}"))
        name.value = make(*arguments)
        ctypes.CFUNCTYPE(None, ctypes.c_uint)(address(f"glDelete{kind}"))(name)
    else:
        for do in ("Gen", "Delete"):
            function = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(address(f"gl{do}{kind}s"))
            function(1, ctypes.byref(name))
    return int(name.value)


@dataclass
class Watch:
    """Looks at one thing that must not grow."""

    size: Callable[[], float]
    """Says how much there is of it now."""
    times: list[float] = field(default_factory=list)
    """What the work's counter said at each look."""
    sizes: list[float] = field(default_factory=list)
    """What was there then."""

    def look(self, at: float) -> None:
        """Look. at: how often, or for how long, the work was done so far."""
        self.times.append(at)
        self.sizes.append(self.size())

    def slope(self) -> float:
        """Return the growth for each round, or second, of a straight line through all but the first looks."""
        first = int(len(self.times) * SKIPPED)
        return float(np.polyfit(self.times[first:], self.sizes[first:], 1)[0])

    def range(self) -> tuple[float, float]:
        """Return the least and the most that there was, the first looks aside."""
        first = int(len(self.sizes) * SKIPPED)
        return min(self.sizes[first:]), max(self.sizes[first:])


def repeat(work: Callable[[], None], count: int, *watches: Watch) -> None:
    """Do the work `count` times, and look now and then."""
    every = max(1, count // LOOKS)
    for done in range(1, count + 1):
        work()
        if done % every == 0:
            for watch in watches:
                watch.look(done)


def loads(count: int, folder: Path) -> str:
    """Load a model `count` times."""
    path = folder / "m.safetensors"
    save(random_model((32, 1), (32, 1), texture=(16, 1)), path)
    memory = Watch(resident)

    def work() -> None:
        load(path)

    repeat(work, count, memory)
    return grown(memory)


def starts(count: int, _: Path) -> str:
    """Start Python and mplicits `count` times."""
    taken = [
        subprocess.run([sys.executable, "-c", START], capture_output=True, check=True).stdout for _ in range(count)
    ]
    python, ours = 1000 * np.median([np.array(line.split(), float) for line in taken], axis=0)
    return f"{ours:.1f} ms of a processor, after {python:.1f} ms in which Python itself starts (medians)"


def renders(count: int, _: Path) -> str:
    """Make a renderer, draw, and release it, `count` times, in one context."""
    context, shader = open_osmesa(), glsl330.bake(random_model((4, 0)), "texture")
    address = OSMesa().load_opengl_function

    def count_objects() -> int:
        with context:
            return objects(address)

    memory, held = Watch(resident), Watch(count_objects)

    def draw() -> None:
        renderer = Renderer(context, shader)
        renderer.render(PICTURE, Camera())
        renderer.release()

    repeat(draw, count, memory, held)
    context.release()
    return f"{grown(memory)}; {constant(held)}"


def turntable(seconds: int, folder: Path) -> str:
    """Let a window's turntable turn a model for so many seconds."""
    import glfw

    with _window(folder) as (window, memory, held):
        window.desk.shown.view.turntable = True
        began, due, turns, before = time.perf_counter(), 0.0, 0, window.desk.shown.view.camera
        while (spent := time.perf_counter() - began) < seconds:
            window.step()
            turns += window.desk.shown.view.camera != before
            before = window.desk.shown.view.camera
            glfw.poll_events()
            if spent >= due:
                memory.look(spent)
                held.look(spent)
                due += seconds / LOOKS
            time.sleep(0.01)
    return f"{grown(memory, 'second')}; {constant(held)}; {turns:,} pictures"


def resizes(count: int, folder: Path) -> str:
    """Give a window `count` sizes by random, as a window manager does, and wait for the picture of each."""
    import glfw

    rng = np.random.default_rng(0)
    with _window(folder) as (window, memory, held):

        def work() -> None:
            width, height = rng.integers(1, 600), rng.integers(1, 400)
            glfw.set_window_size(window.handle, int(width), int(height))
            for _ in range(STRETCH):
                glfw.wait_events_timeout(0.01)
                window.step()

        repeat(work, count, memory, held)
    return f"{grown(memory)}; {constant(held)}"


@contextmanager
def _window(folder: Path) -> Iterator[tuple["Window", Watch, Watch]]:  # type: ignore[name-defined] # noqa: F821
    """Open a window of `SIDE` pixels on a display of its own, with a panel that is closed.

    Gives it with watches on the memory and on the objects of its context.
    """
    import glfw

    path = folder / "w.safetensors"
    save(random_model((4, 0)), path)
    with virtual_display() as environment:
        os.environ["DISPLAY"] = environment["DISPLAY"]
        from mplicits.viewer.window.greeting import greeted
        from mplicits.viewer.window.window import Window

        def address(name: str) -> int:
            return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

        with greeted("w", (SIDE, SIDE), None) as (context, gui):
            window = Window(context, gui, open_source(path), Camera(), RenderOptions())

            def count_objects() -> int:
                with context:
                    return objects(address)

            yield window, Watch(resident), Watch(count_objects)
            window.close()
        glfw.terminate()


def grown(memory: Watch, each: str = "time") -> str:
    """Say how a process's memory grew."""
    least, most = memory.range()
    return f"memory grows by {memory.slope():,.0f} bytes each {each}, within {(most - least) / 2**20:.1f} MiB in all"


def constant(held: Watch) -> str:
    """Say how the number of OpenGL's objects changed."""
    least, most = held.range()
    return f"{least:.0f} objects of OpenGL all the time" if least == most else f"{least:.0f} to {most:.0f} of OpenGL"
