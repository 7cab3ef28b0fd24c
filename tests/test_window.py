"""The desktop window: what keys and the pointer do, what it draws, and what it says without a display."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from codegen.errors import UserError
from fitted_model import fitted_model
from random_model import random_model
from viewer.camera import Camera
from viewer.options import RenderOptions
from viewer.window import COARSEST, SLOW, View, show_window


@pytest.fixture
def view() -> View:
    view = View(fitted_model(), Camera(10, 20, 3.0), RenderOptions())
    view.changed = False
    return view


def test_dragging_turns_and_pans(view: View) -> None:
    view.turn(0.5, 0.1)
    assert (view.camera.azimuth, view.camera.elevation) == (280.0, 2.0)
    assert view.changed
    assert view.moving
    before = view.camera
    view.pan(0.5, 0.0)
    centre = np.array([*before.target, 1.0])
    seen = np.linalg.inv(view.camera.matrix()) @ centre
    assert abs(seen[0] / -seen[2] * view.camera.focal - 1.0) < 1e-5, "half a height to the right: where the pointer is"


def test_the_wheel_zooms(view: View) -> None:
    view.zoom(1)
    assert view.camera.away < 3.0
    view.zoom(-1)
    assert abs(view.camera.away - 3.0) < 1e-9


def test_keys(view: View) -> None:
    for key, shading in (("N", "normal"), ("D", "depth"), ("X", "steps"), ("T", "texture"), ("P", "phong")):
        view.key(key)
        assert view.options.shading == shading
    view.key("1")
    assert (view.options.level, view.options.normal_level) == (1, 1)
    view.key("3")
    view.key("0")
    assert view.options.level == 1, "the model has 2 levels"
    view.turn(1, 1)
    view.key("R")
    assert view.camera == Camera(10, 20, 3.0)


def test_no_texture_no_texture_shading() -> None:
    view = View(random_model((4, 0)), Camera(), RenderOptions())
    view.key("T")
    assert view.options.shading == "phong"


def test_slow_frames_get_fewer_pixels(view: View) -> None:
    for _ in range(10):
        view.timed(2 * SLOW)
    assert view.coarse == COARSEST
    for _ in range(10):
        view.timed(SLOW / 100)
    assert view.coarse == 1


def test_without_a_display_it_names_render(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(UserError, match="mplicits render") as raised:
        show_window(fitted_model(), Camera(), RenderOptions(), (32, 32), "auto")
    assert "\n" not in str(raised.value)


SCRIPT = """
import json, sys, threading, time
import glfw
import numpy as np
from fitted_model import fitted_model
from viewer.camera import Camera
from viewer.options import RenderOptions
from viewer.window import View, Window

view = View(fitted_model(), Camera(), RenderOptions(samples=1))
window = Window(view, (64, 48), "auto")
handle = window.context.handle
report = {}

def screen():
    width, height = glfw.get_framebuffer_size(handle)
    with window.context as gl:
        glfw.swap_buffers(handle)  # what was shown comes back to be read
        data = gl.screen.read(viewport=(0, 0, width, height), components=3)
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1] / 255.0

def press(key):
    window._on_key(handle, key, 0, glfw.PRESS, 0)

window.draw()
size = glfw.get_framebuffer_size(handle)
phong = window.renderer.render(size, view.camera, view.options)[..., :3]
report["phong"] = float(np.abs(screen() - phong).max())
press(glfw.KEY_N)
window.draw()
report["changed"] = float(np.abs(screen() - phong).max())
press(glfw.KEY_S)

for _ in range(10):  # the display server asks for the first pictures itself
    glfw.wait_events_timeout(0.02)
draws = []
draw = window.draw
window.draw = lambda quick=False: (draws.append(quick), draw(quick))
def user():
    time.sleep(0.3)
    for _ in range(5):
        glfw.post_empty_event()
        time.sleep(0.05)
    view.turn(0.1, 0.0)
    glfw.post_empty_event()
    time.sleep(0.5)
    press(glfw.KEY_ESCAPE)
    glfw.post_empty_event()
threading.Thread(target=user, daemon=True).start()
view.changed = True
window.loop()
report["draws"] = draws
window.close()
print(json.dumps(report))
"""


def test_the_window_shows_the_picture(tmp_path: Path, xvfb: dict[str, str]) -> None:
    here = Path(__file__).parent
    paths = f"import sys; sys.path[:0] = [{str(here)!r}, {str(here.parent)!r}]\n"
    arguments = [sys.executable, "-c", paths + SCRIPT]
    done = subprocess.run(arguments, cwd=tmp_path, env=xvfb, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    saved, line = done.stdout.splitlines()
    report = json.loads(line)
    assert report["phong"] < 2 / 255
    assert report["changed"] > 0.1
    assert saved == "saved mplicits-1.png"
    assert (tmp_path / "mplicits-1.png").exists()
    assert report["draws"] == [False, True, False], "first picture, a quick one for the move, the full one at rest"
