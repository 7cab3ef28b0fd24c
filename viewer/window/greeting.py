"""The window before its first picture. It opens before slow imports (numpy, the model, the renderer)."""

from collections.abc import Iterator
from contextlib import contextmanager

import glfw

from ...codegen.targets.uniforms import default
from ..draw.context import Context, open_window
from .gui import Gui

Color = tuple[float, ...]
"""sRGB, red, green and blue in [0, 1]."""


@contextmanager
def greeted(name: str, size: tuple[int, int], background: Color | None) -> Iterator[tuple[Context, Gui | None]]:
    """Open a window that says that the shader of `name` is being compiled.

    size: (width, height) in screen coordinates. background: behind the text; None: the bottom of the default one.
    Yields the window's context and, if imgui-bundle is installed, its GUI. Raises UserError if there is no display.
    """
    context, gui = open_window(size, f"{name}   compiling", visible=True), None
    color = background or default("background_bottom")
    try:
        _paint(context, color)
        try:
            gui = Gui(context)
        except ImportError:  # imgui-bundle, of the extra `view`, is not installed
            pass
        else:
            _paint(context, color, gui, f"{name}: compiling the shader")
        yield context, gui
    finally:
        if gui is not None:
            gui.release()
        context.release()


def _paint(context: Context, background: Color, gui: Gui | None = None, notice: str = "") -> None:
    """Fill the window with its background and a notice in its middle."""
    red, green, blue = background
    with context as gl:
        gl.screen.use()
        gl.screen.clear(red, green, blue)
        if gui is not None:
            gui.build_notice(notice)
            gui.draw()
        glfw.swap_buffers(context.handle)
