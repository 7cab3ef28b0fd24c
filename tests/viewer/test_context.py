"""Contexts: each kind draws, several coexist, and the error of a missing kind names what to install."""

import ctypes
import os
import pwd
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import moderngl
import numpy as np
import pytest

import mplicits
from mplicits.model.errors import UserError
from mplicits.viewer.draw import context as contexts
from mplicits.viewer.draw import osmesa as osmesa_module
from mplicits.viewer.draw import shader_cache
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context, open_context
from support import needs
from support.paths import ROOT, TESTS
from support.random_model import random_model

FRAGMENT = "#version 330\nuniform float shade;\nout vec4 color;\nvoid main() { color = vec4(shade, 0.5, 0.25, 1.0); }"


class Square:
    """A program and a framebuffer of 4 x 4 pixels that stay in their context between draws."""

    def __init__(self, context: Context) -> None:
        self.context = context
        with context as gl:
            self.program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT)
            self.triangle = gl.vertex_array(self.program, [])
            self.target = gl.framebuffer([gl.texture((4, 4), 4, dtype="f4")])

    def draw(self, shade: float) -> float:
        """Draw every pixel with this red, and return the red of the first one."""
        with self.context:
            self.program["shade"] = shade
            self.target.use()
            self.triangle.render(vertices=3)
            return float(np.frombuffer(self.target.read(components=4, dtype="f4"), np.float32)[0])


@pytest.mark.parametrize("kind", ["osmesa", "egl", "auto"])
def test_a_context_of_each_kind_draws(kind: str) -> None:
    context = needs.context(kind)
    assert Square(context).draw(0.375) == 0.375
    assert context.renderer
    assert context.kind in ("osmesa", "egl")
    context.release()


def test_contexts_of_two_kinds_alternate_and_nest(osmesa: Context) -> None:
    squares = [Square(needs.context(kind)) for kind in ("osmesa", "egl", "osmesa")]
    for i in range(3):
        for j, square in enumerate(squares):
            assert square.draw(i + 10 * j) == i + 10 * j
    squares[0].context.release()
    nested = Square(osmesa)
    with osmesa:
        assert nested.draw(1) == 1
        assert nested.draw(2) == 2
    for square in (*squares[1:], nested):
        assert square.draw(7) == 7
    for square in squares[1:]:
        square.context.release()


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with neither OSMesa nor EGL nor a display."""
    monkeypatch.setattr(osmesa_module, "OSMESA_LIBRARIES", ("libOSMesa-missing.so.8",))
    monkeypatch.setattr(contexts, "EGL_LIBRARY", "libEGL-missing.so.1")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.usefixtures("bare")
@pytest.mark.parametrize(
    ("kind", "remedies"),
    [
        ("osmesa", ["libosmesa6"]),
        ("egl", ["libegl1", "libgl1-mesa-dri"]),
        ("window", ["display"]),
        ("auto", ["libosmesa6", "libegl1", "display"]),
    ],
)
def test_a_missing_kind_names_what_to_install(kind: str, remedies: list[str]) -> None:
    with pytest.raises(UserError) as raised:
        open_context(kind)
    assert "\n" not in str(raised.value)
    for remedy in remedies:
        assert remedy in str(raised.value)


@pytest.mark.parametrize("missing", ["egl", "osmesa"])
def test_auto_opens_the_installed_kind(missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    needs.context({"egl": "osmesa", "osmesa": "egl"}[missing]).release()
    if missing == "egl":
        monkeypatch.setattr(contexts, "EGL_LIBRARY", "libEGL-missing.so.1")
    else:
        monkeypatch.setattr(osmesa_module, "OSMESA_LIBRARIES", ("libOSMesa-missing.so.8",))
    context = open_context("auto")
    assert Square(context).draw(0.5) == 0.5
    assert context.kind != missing
    context.release()


@pytest.mark.parametrize(
    ("kind", "module", "name", "value", "message"),
    [
        ("osmesa", osmesa_module, "OSMESA_LIBRARIES", ("libc.so.6",), "libosmesa6"),
        ("osmesa", osmesa_module, "GL_VERSION", (9, 9), "no OpenGL"),
        ("egl", contexts, "EGL_LIBRARY", "libc.so.6", "libegl1"),
    ],
)
def test_a_library_without_opengl_3_3_is_an_error(
    monkeypatch: pytest.MonkeyPatch, kind: str, module: object, name: str, value: object, message: str
) -> None:
    needs.context(kind).release()
    monkeypatch.setattr(module, name, value)
    with pytest.raises(UserError, match=message):
        open_context(kind)


def test_a_hidden_window_draws_beside_other_contexts(xvfb: dict[str, str]) -> None:
    """It runs in a process of its own: GLFW keeps the display that it was first started with."""
    code = (
        f"import sys; sys.path[:0] = [{str(Path(__file__).parent)!r}, {str(TESTS)!r}]\n"
        "from test_context import Square; from mplicits.viewer.draw.context import open_context\n"
        "squares = [Square(open_context(kind)) for kind in ('window', 'osmesa', 'window')]\n"
        "print(all(square.draw(i) == i for i in range(4) for square in squares), squares[0].context.kind)"
    )
    arguments = [sys.executable, "-c", code]
    done = subprocess.run(arguments, env=xvfb, capture_output=True, text=True, check=False, timeout=300)
    assert done.stdout.split() == ["True", "window"], done.stderr


def test_a_forked_process_is_told_that_opengl_is_not_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contexts, "_PROCESSES", {1})
    with pytest.raises(UserError, match="forked after a picture"):
        mplicits.Field(random_model((4, 0))).render(size=8)


@pytest.mark.slow
def test_a_picture_in_a_forked_child_is_refused_and_one_in_a_spawned_child_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "draw.py").write_text(
        "import multiprocessing, sys\n"
        "import mplicits\n"
        "def draw(_):\n"
        "    try: return mplicits.load('spot-small').render(size=8, samples=1).shape\n"
        "    except mplicits.UserError as error: return str(error)\n"
        "if __name__ == '__main__':\n"
        "    draw(0)\n"
        "    for method in ('fork', 'spawn'):\n"
        "        with multiprocessing.get_context(method).Pool(1) as pool: print(*pool.map(draw, [0]))\n"
    )
    command = [sys.executable, "draw.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=True)
    refused, drawn = done.stdout.splitlines()
    assert "forked after a picture" in refused
    assert drawn == "(8, 8, 3)"


@pytest.mark.parametrize("kind", ["egl", "osmesa"])
def test_the_caller_s_own_context_stays_current(kind: str) -> None:
    """A program's own context of EGL is current before and after a picture."""
    settings: Any = {"backend": "egl"}
    try:
        own = moderngl.create_context(330, standalone=True, **settings)
    except Exception:  # glcontext raises bare Exception
        needs.lack("EGL")
    library = ctypes.CDLL("libEGL.so.1")
    library.eglGetCurrentContext.restype = ctypes.c_void_p
    before = library.eglGetCurrentContext()
    assert before
    mplicits.Field(random_model((4, 0))).render(size=8, samples=1, context=kind)
    assert library.eglGetCurrentContext() == before
    assert own.buffer(b"1234").read() == b"1234"
    own.release()


@pytest.mark.parametrize(("free", "off"), [(1 << 20, True), (1 << 40, False)])
def test_a_full_disk_turns_the_shader_cache_off(
    free: int, off: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in shader_cache.OFF:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path / "none" / "yet"))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    shader_cache.guard_shader_cache()
    assert all((name in os.environ) == off for name in shader_cache.OFF)
    for name in shader_cache.OFF:
        os.environ.pop(name, None)


def test_the_folder_of_the_shader_cache_is_mesa_s(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A user without a folder, such as nobody, has no cache, even where HOME names one: Mesa would print a line."""
    monkeypatch.delenv("MESA_SHADER_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert shader_cache._folder() == Path(pwd.getpwuid(os.getuid()).pw_dir, ".cache")


@pytest.mark.parametrize("kind", ["egl", "osmesa", "auto"])
def test_a_driver_that_is_not_there_is_one_line(kind: str, tmp_path: Path) -> None:
    """OSMesa would end the process by a signal, and EGL prints a line of its own."""
    command = [
        sys.executable,
        "-m",
        "mplicits",
        "render",
        "spot-small",
        "--context",
        kind,
        "-o",
        str(tmp_path / "p.png"),
    ]
    environment = os.environ | {"GALLIUM_DRIVER": "nothere", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=ROOT.parent, timeout=300, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1, done.stderr
