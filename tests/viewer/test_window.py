"""The window under Xvfb with real events: their effects, the screen, and when the window sleeps."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mplicits.cli import main
from mplicits.model.model_file import save
from support import needs
from support.fitted_model import fitted_model
from support.random_model import random_model
from support.window_script import run


@pytest.fixture
def without_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """No window can be opened."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.usefixtures("without_display")
def test_without_a_display_the_error_names_render_and_the_web_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    assert main(["view", str(tmp_path / "m.safetensors")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(r"mplicits render.*page", line)


@pytest.mark.usefixtures("without_display")
@pytest.mark.parametrize(
    "name", ["none.safetensors", "broken.safetensors", "shape.obj", "none.glsl", "broken.glsl", "."]
)
def test_a_file_that_is_no_model_is_an_error_before_a_window_opens(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for file in ("broken.safetensors", "shape.obj", "broken.glsl"):
        (tmp_path / file).write_bytes(b"\7" * 40)
    assert main(["view", str(tmp_path / name)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(tmp_path / name) in line
    assert "display" not in line


GREETING = """
import json, os, sys, time
from contextlib import contextmanager
from PIL import ImageGrab
from mplicits.cli import main
from mplicits.viewer.window import greeting
greeted = greeting.greeted

@contextmanager
def watched(*arguments):
    with greeted(*arguments) as window:
        imported = [name for name in ("numpy", "mplicits.viewer.draw.renderer") if name in sys.modules]
        end = time.perf_counter() + 60
        seen = []
        while time.perf_counter() < end:  # the display server takes its time
            screen = ImageGrab.grab(xdisplay=os.environ["DISPLAY"]).convert("RGB").crop((0, 0, 320, 200))
            seen = screen.getcolors(64000)
            if screen.getpixel((5, 5)) != (0, 0, 0) and (len(seen) > 10 or window[1] is None):
                break
        print(json.dumps([imported, screen.getpixel((5, 5)), len(seen), window[1] is not None]))
        yield window

greeting.greeted = watched
sys.exit(main(["view", "m.safetensors", "--size", "320x200", "--background", "0000ff,ff8000", *sys.argv[1:]]))
"""


@pytest.mark.parametrize(("options", "reason"), [(["--shade", "texture"], "no texture"), (["--level", "2"], "level 2")])
def test_a_window_opens_before_slow_imports_and_closes_on_bad_options(
    options: list[str], reason: str, tmp_path: Path, xvfb: dict[str, str]
) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    command = [sys.executable, "-c", GREETING, *options]
    done = subprocess.run(command, cwd=tmp_path, env=xvfb, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 2, done.stderr
    imported, corner, colors, notice = json.loads(done.stdout)
    assert imported == [], "they take longer than to open a window"
    assert corner == [255, 128, 0]
    assert (colors > 10) == notice, "a notice lies on the background"
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert reason in lines[0]


EVENTS = """
settle()
report["phong"] = difference()
for name, key in (("N", glfw.KEY_N), ("1", glfw.KEY_1), ("D", glfw.KEY_D)):
    window._on_key(handle, key, 0, glfw.PRESS, 0)
    settle()
    report[name] = difference()
window._on_key(handle, glfw.KEY_S, 0, glfw.PRESS, 0)
settle()
report["saved"] = [str(path) for path in Path().glob("*.png")]
for _ in range(10):  # the display server asks for the first pictures itself
    glfw.wait_events_timeout(0.02)
settle()
paints, paint = [], window.paint
window.paint = lambda swap=True: (paints.append(viewer.drawing.timing), paint(swap))
steps, step = [], window.step
window.step = lambda: (steps.append(1), step())[1]
before = time.process_time()
user(lambda: None, lambda: None, lambda: None, lambda: None)
report["idle"] = [len(paints), len(steps), time.process_time() - before]
view.coarse = 2
user(lambda: view.turn(0.1, 0.0))
report["moved"] = paints
window._on_drop(handle, ["nothing.safetensors"])
settle()
report["dropped"] = viewer.message
"""


def test_keys_change_the_picture_and_an_idle_window_sleeps(tmp_path: Path, xvfb: dict[str, str]) -> None:
    save(fitted_model(), tmp_path / "m.safetensors")
    report = run(EVENTS, (64, 48), tmp_path, xvfb)
    for shading in ("phong", "N", "1", "D"):
        assert float(str(report[shading])) < 1.1 / 255, shading
    assert report["saved"] == ["fitted.png"]
    idle, moved = report["idle"], report["moved"]
    assert isinstance(idle, list)
    assert isinstance(moved, list)
    assert idle[0] == 0, "nothing is painted"
    assert idle[1] <= 7, "the window wakes for the five events, and no more"
    assert idle[2] < 0.2, "seconds of the processor"
    assert "32x24" in moved[0]
    assert "64x48" in moved[-1]
    assert "nothing.safetensors" in str(report["dropped"])


MOUSE = """
import os
glfw.set_window_pos(handle, 0, 0)
settle()
def mouse(*arguments, done=lambda: True):
    subprocess.run(["xdotool", *map(str, arguments)], check=True)
    wait(done)
home = view.camera
mouse("mousemove", 500, 200)
mouse("mousedown", 1)
mouse("mousemove", 540, 200, done=lambda: view.camera != home)
mouse("mouseup", 1)
report["turned"] = (view.camera.azimuth - home.azimuth) % 360
azimuth = view.camera.azimuth
turned = view.camera
mouse("mousedown", 3)
mouse("mousemove", 560, 200, done=lambda: view.camera != turned)
mouse("mouseup", 3)
report["panned"] = view.camera.target != home.target
mouse("click", 4, done=lambda: view.camera.away < home.away)
report["nearer"] = view.camera.away < home.away
mouse("key", "h", done=lambda: view.help)
report["help"] = view.help
mouse("key", "Escape", done=lambda: not view.help)
report["escaped"] = [view.help, bool(glfw.window_should_close(handle))]
mouse("key", "m", done=lambda: viewer.message)
report["m"], viewer.message = viewer.message, ""
report["level"] = view.options.level
mouse("mousemove", 30, 75)
mouse("mousedown", 1)
mouse("mousemove", 32, 75, done=lambda: view.options.level)
mouse("mouseup", 1)
report["panel"] = [view.options.level, view.camera.azimuth == azimuth]
width = window.area[2]
mouse("key", "Tab", done=lambda: window.area[2] > width)
report["wider"] = window.area[2] - width
mouse("key", "space", done=lambda: view.turntable)
report["turntable"] = view.turntable
mouse("key", "space", done=lambda: not view.turntable)
settle()
report["picture"] = difference()
mouse("key", "Tab", done=lambda: view.panel)
report["open"] = view.panel
glfw.set_window_size(handle, 480, 400)
wait(lambda: not view.panel)
report["folded"] = not view.panel
"""


@pytest.mark.slow
def test_the_mouse_turns_the_picture_and_operates_the_panel(tmp_path: Path, xvfb: dict[str, str]) -> None:
    needs.program("xdotool")
    needs.package("imgui_bundle")
    save(random_model((4, 0), (4, 0)), tmp_path / "m.safetensors")
    report = run(MOUSE, (620, 400), tmp_path, xvfb)
    assert report["turned"] == pytest.approx(342.0)
    assert report["panned"]
    assert report["nearer"]
    assert "h: all keys" in str(report["greeting"])
    assert report["help"]
    assert report["escaped"] == [False, False], "Esc closes the help, and not the window"
    assert "drop one here" in str(report["m"])
    assert report["open"]
    assert report["folded"], "below 500 pixels"
    assert report["level"] is None
    assert report["panel"] == [1, True], "a click on the slider's left end is for the panel alone"
    assert report["wider"] == 300
    assert report["turntable"]
    assert float(str(report["picture"])) < 1.1 / 255


SIZES = """
view.options = RenderOptions()
for width, height in ((1, 1), (3840, 2160), (200, 10), (64, 48)):
    glfw.set_window_size(handle, width, height)
    wait(lambda: glfw.get_window_size(handle) == (width, height))
    window.paint()
    report[f"{width}x{height}"] = window.area[2:]
settle()
report["picture"] = difference()
"""


@pytest.mark.slow
def test_windows_from_one_pixel_to_4k_are_drawn(tmp_path: Path, xvfb: dict[str, str]) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    report = run(SIZES, (64, 48), tmp_path, xvfb)
    assert report["1x1"] == [1, 1]
    wide = report["3840x2160"]
    assert isinstance(wide, list)
    assert wide[1] == 2160
    assert report["64x48"] == [64, 48]
    assert float(str(report["picture"])) < 1.1 / 255
