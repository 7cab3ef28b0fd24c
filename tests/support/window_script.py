"""Runs a script that drives a real window under Xvfb in its own process, and returns its report."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

START = """
import json, subprocess, sys, threading, time
from contextlib import ExitStack
from pathlib import Path
import glfw
import numpy as np
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state.source import open_source
from mplicits.viewer.window.greeting import greeted
from mplicits.viewer.window.window import Window

stack = ExitStack()
context, gui = stack.enter_context(greeted("m", SIZE, None))
window = Window(context, gui, open_source(Path("m.safetensors")), Camera(), RenderOptions(samples=2), watch=WATCH)
viewer, view, handle = window.viewer, window.viewer.view, window.handle
report = {"greeting": viewer.message}
viewer.message = ""  # it would lie over the pictures that are compared

def screen():
    "The window's pixels (H, W, 3) in [0, 1], top row first."
    window.paint(swap=False)
    width, height = glfw.get_framebuffer_size(handle)
    with window.context as gl:
        data = gl.screen.read(viewport=(0, 0, width, height), components=3)
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1] / 255.0

def settle(seconds=300.0):
    "Runs the loop until nothing is left to do."
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        window.step()
        glfw.poll_events()
        if viewer.idle and not (window.gui and window.gui.needs_frames):
            return
        time.sleep(0.002)
    raise SystemExit("the window never becomes idle")

def wait(condition, seconds=300.0):
    "Runs the loop for 0.2 s, and then until the condition holds: the display server takes its time."
    begin = time.perf_counter()
    while time.perf_counter() < begin + 0.2 or not condition() and time.perf_counter() < begin + seconds:
        glfw.wait_events_timeout(0.01)
        window.step()

def difference():
    "The largest difference, over all pixels and channels, between the window's picture and what render draws."
    x, y, width, height = window.area
    rendered = viewer.renderer.render((width, height), view.camera, view.options)[..., :3]
    return float(np.abs(screen()[:, x:] - rendered).max())

def user(*actions):
    "Runs the loop, does the actions beside it, each 0.25 s later once nothing is left to do, and closes the window."
    def run():
        for action in (*actions, lambda: glfw.set_window_should_close(handle, True)):
            time.sleep(0.25)
            while not viewer.idle:
                time.sleep(0.01)
            action()
            glfw.post_empty_event()
    threading.Thread(target=run, daemon=True).start()
    window.loop()
    glfw.set_window_should_close(handle, False)
"""
END = """
window.close()
stack.close()
print(json.dumps(report))
"""


def run(
    script: str, size: tuple[int, int], folder: Path, environment: dict[str, str], watch: bool = False
) -> dict[str, Any]:
    """Return the `report` of a script.

    size: (width, height) of the window, as the system counts it. folder: the process's working folder, with the model
    m.safetensors in it. environment: of the process. watch: as the viewer's option --watch.
    """
    text = START.replace("SIZE", repr(size)).replace("WATCH", repr(watch)) + script + END
    process = subprocess.run(
        [sys.executable, "-c", text],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert process.returncode == 0, process.stderr + process.stdout
    report: dict[str, Any] = json.loads(process.stdout.splitlines()[-1])
    return report
