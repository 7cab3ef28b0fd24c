"""What a window shows before its first picture.

It comes before numpy, the model and all that draws it are imported: that takes longer than to open a window.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import glfw

from ...codegen.targets.uniforms import default
from ..draw.context import Context, open_window
from .gui import Gui, open_gui

Colour = tuple[float, ...]
"""sRGB, red, green and blue in [0, 1]."""


@contextmanager
def greeted(name: str, size: tuple[int, int], background: Colour | None) -> Iterator[tuple[Context, Gui | None]]:
    """Open a window which says that the shader of `name` is being compiled, which may take half a minute.

    size: (width, height), as the system counts it. background: behind these words; None: the default one's bottom.
    Gives the window's context, and its GUI if imgui-bundle is installed; both are freed at the end. Raises UserError
    where there is no display.
    """
    context, gui = open_window(size, f"{name}   compiling", visible=True), None
    try:
        _paint(context, background or default("background_bottom"))
        gui = open_gui(context)
        if gui is not None:
            _paint(context, background or default("background_bottom"), gui, f"{name}: compiling the shader")
        yield context, gui
    finally:
        if gui is not None:
            gui.release()
        context.release()


def _paint(context: Context, background: Colour, gui: Gui | None = None, notice: str = "") -> None:
    """Fill the window with its background and, where there is a GUI, a notice in its middle."""
    red, green, blue = background
    with context as gl:
        gl.screen.use()
        gl.screen.clear(red, green, blue)
        if gui is not None:
            gui.build_notice(notice)
            gui.draw()
        glfw.swap_buffers(context.handle)
