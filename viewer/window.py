"""The desktop window of `mplicits view`."""

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import moderngl

from codegen.errors import UserError
from codegen.files import show
from codegen.glsl330 import bake
from codegen.model import Model

from .camera import Camera
from .context import NoDisplayError, open_window
from .options import RenderOptions
from .renderer import VERTEX_SHADER, Renderer
from .screenshot import save_png

KEYS = """drag: turn   right drag: move   wheel: nearer, farther
1..9: level   n: normals   p: Phong   d: depth   t: texture   x: steps
r: reset the camera   s: save a picture   h: this help   Esc: quit"""
SHADING_KEYS = {"N": "normal", "P": "phong", "D": "depth", "T": "texture", "X": "steps"}
SLOW = 0.12
"""Seconds a frame may take while the camera moves; beyond that fewer pixels are drawn until it rests."""
COARSEST = 8
REST = 0.15
"""Seconds without a move after which the full picture is drawn."""
PRESENT_SHADER = """#version 330
uniform sampler2D picture;
uniform vec2 window;
out vec4 color;
void main() { color = texture(picture, gl_FragCoord.xy / window); }
"""


@dataclass
class View:
    """What the window shows; `changed` asks for a new frame, `moving` for a quick one."""

    model: Model
    home: Camera
    options: RenderOptions
    camera: Camera = field(init=False)
    changed: bool = True
    moving: bool = False
    coarse: int = 1

    def __post_init__(self) -> None:
        self.camera = self.home

    def move(self, camera: Camera) -> None:
        """Takes a new camera."""
        self.camera, self.changed, self.moving = camera, True, True

    def turn(self, right: float, up: float) -> None:
        """A drag, as shares of the window's height: half a turn from edge to edge."""
        self.move(self.camera.orbited(-180.0 * right, -180.0 * up))

    def pan(self, right: float, up: float) -> None:
        """A drag, as shares of the window's height: the target's plane follows the pointer."""
        height = 2.0 * self.camera.away / self.camera.focal
        self.move(self.camera.panned(-height * right, -height * up))

    def zoom(self, notches: float) -> None:
        """A wheel's notches; up is nearer."""
        self.move(self.camera.zoomed(0.9**notches))

    def key(self, key: str) -> None:
        """A key that changes what is shown: a shading's letter, a level's digit, R."""
        if key == "R":
            self.move(self.home)
        elif key in SHADING_KEYS and (key != "T" or self.model.texture is not None):
            self.options = replace(self.options, shading=SHADING_KEYS[key])
        elif key.isdecimal() and 1 <= int(key) <= len(self.model.levels):
            self.options = replace(self.options, level=int(key), normal_level=int(key))
        self.changed = True

    def timed(self, seconds: float) -> None:
        """Adapts the pixels of a moving frame to what the last one took."""
        if seconds > SLOW:
            self.coarse = min(COARSEST, self.coarse * 2)
        elif seconds < SLOW / 6:
            self.coarse = max(1, self.coarse // 2)


class Window:
    """A visible GLFW window that shows a View through a Renderer.

    Raises UserError where there is no display, and what `Renderer` raises.
    """

    def __init__(self, view: View, size: tuple[int, int], storage: str) -> None:
        self.view = view
        self._name = show(view.model.name)
        self._pointer = (0.0, 0.0)
        self.context = open_window(size, f"{self._name}   compiling", visible=True)
        try:
            self.renderer = Renderer(self.context, bake(view.model, storage))
            self.renderer.schedule(view.options)
            with self.context as gl:
                self._present = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=PRESENT_SHADER)
                self._triangle = gl.vertex_array(self._present, [])
        except UserError:
            self.context.release()
            raise
        self._listen(self.context.handle)

    def loop(self) -> None:
        """Until closed. Draws only when something changed; while the camera moves, a slow driver draws fewer pixels."""
        import glfw

        while not glfw.window_should_close(self.context.handle):
            if self.view.changed or self.view.moving:
                quick = self.view.changed and self.view.moving
                self.view.changed, self.view.moving = False, quick
                self.draw(quick)
            if self.view.moving:
                glfw.wait_events_timeout(REST)
            else:
                glfw.wait_events()

    def draw(self, quick: bool = False) -> None:
        """One frame; a quick one at the resolution that the last ones' times suggest."""
        import glfw

        width, height = (max(1, side) for side in glfw.get_framebuffer_size(self.context.handle))
        scale = self.view.coarse if quick else 1
        pixels = (max(1, width // scale), max(1, height // scale))
        start = time.perf_counter()
        with self.context as gl:
            texture = self.renderer.frame(pixels, self.view.camera, self.view.options)
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.use(0)
            self._present["window"] = (width, height)
            gl.screen.use()
            gl.screen.viewport = (0, 0, width, height)
            self._triangle.render(moderngl.TRIANGLES, vertices=3)
            glfw.swap_buffers(self.context.handle)
            gl.finish()
        seconds = time.perf_counter() - start
        if quick:
            self.view.timed(seconds)
        title = f"{self._name}   {1000 * seconds:.1f} ms   {pixels[0]}x{pixels[1]}"
        glfw.set_window_title(self.context.handle, title)

    def save(self) -> None:
        """Writes what is shown to the first free mplicits-N.png of the working folder."""
        import glfw

        number = 1
        while (path := Path(f"mplicits-{number}.png")).exists():
            number += 1
        options = replace(self.view.options, samples=4)
        size = glfw.get_framebuffer_size(self.context.handle)
        try:
            save_png(path, self.renderer.render(size, self.view.camera, options), self.view.model.name)
            print(f"saved {path}", flush=True)
        except UserError as error:
            print(f"not saved: {error}", flush=True)

    def close(self) -> None:
        """Frees the window."""
        self.renderer.release()
        self.context.release()

    def _listen(self, window: Any) -> None:
        import glfw

        def refresh(*_: Any) -> None:
            self.view.changed = True

        glfw.set_cursor_pos_callback(window, self._on_cursor)
        glfw.set_scroll_callback(window, lambda _, _x, y: self.view.zoom(y))
        glfw.set_key_callback(window, self._on_key)
        glfw.set_window_refresh_callback(window, refresh)
        glfw.set_framebuffer_size_callback(window, refresh)

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        import glfw

        height = max(1, glfw.get_window_size(window)[1])
        right, up = (x - self._pointer[0]) / height, (self._pointer[1] - y) / height
        self._pointer = (x, y)
        if glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_LEFT) == glfw.PRESS:
            self.view.turn(right, up)
        elif glfw.get_mouse_button(window, glfw.MOUSE_BUTTON_RIGHT) == glfw.PRESS:
            self.view.pan(right, up)

    def _on_key(self, window: Any, code: int, _scan: int, action: int, _mods: int) -> None:
        import glfw

        if action != glfw.PRESS:
            return
        if code == glfw.KEY_ESCAPE:
            glfw.set_window_should_close(window, True)
        elif code == glfw.KEY_H:
            print(KEYS, flush=True)
        elif code == glfw.KEY_S:
            self.save()
        elif glfw.KEY_0 <= code <= glfw.KEY_Z:
            self.view.key(chr(code))


def show_window(model: Model, camera: Camera, options: RenderOptions, size: tuple[int, int], storage: str) -> None:
    """Opens the window and returns when it is closed. Raises UserError where there is no display."""
    try:
        window = Window(View(model, camera, options), size, storage)
    except NoDisplayError as error:
        raise UserError(f"{error}; `mplicits render` draws a picture without one") from None
    try:
        print(KEYS, flush=True)
        window.loop()
    finally:
        window.close()
