"""Neither renderers nor a window's turntable leak OpenGL objects or memory."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.model_file import save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.osmesa import OSMesa
from mplicits.viewer.draw.rasterizer import Rasterizer
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.state.picture import Picture
from support.gl_objects import count_objects
from support.paths import TESTS
from support.random_model import random_model
from support.triangle_meshes import SQUARE
from support.window_script import run

MODEL = random_model((4, 0), (4, 0))


def test_released_renderers_leave_no_objects(osmesa: Context) -> None:
    address = OSMesa().load_opengl_function

    def objects() -> int:
        with osmesa:
            return count_objects(address)

    before = objects()
    shader = bake(MODEL, "texture", passes=True)
    makers: list[Callable[[], Renderer | Rasterizer]] = [
        lambda: Renderer(osmesa, shader, "softbox"),
        lambda: Rasterizer(osmesa, MODEL, SQUARE, "texture"),
    ]
    for make in makers:
        renderer = make()
        renderer.render((20, 16), Camera(), RenderOptions(samples=4))
        assert objects() > before + 3
        renderer.release()
        assert objects() == before
    picture = Picture(osmesa)
    assert objects() > before + 3
    picture.release()
    assert objects() == before


TURNTABLE = f"""
import ctypes
sys.path.insert(0, {str(TESTS)!r})
from support.gl_objects import count_objects, resident

def address(name):
    return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

def sizes():
    with window.context:
        return [count_objects(address), resident()]

def turn(count):
    pictures = 0
    while pictures < count:
        before = view.camera
        window.step()
        pictures += view.camera != before
        glfw.poll_events()
        time.sleep(0.01)

view.turntable = True
turn(40)
report["before"] = sizes()
turn(100)
report["after"] = sizes()
"""


@pytest.mark.slow
def test_a_turntable_leaks_nothing(tmp_path: Path, xvfb: dict[str, str]) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    report = run(TURNTABLE, (64, 48), tmp_path, xvfb)
    (objects, memory), (objects_after, memory_after) = report["before"], report["after"]
    assert objects_after == objects > 10
    assert memory_after - memory < 2 * 2**20
