"""What a window shows before its first picture, and says with it."""

import glfw

from ...codegen.targets.uniforms import default
from ..draw.context import Context
from ..draw.options import RenderOptions
from .gui import Gui

GREETING = "h: all keys.  Drop a model, a mesh or a point cloud here to look at it."
"""What a window with a panel says when its first picture comes."""


def greet(context: Context, gui: Gui | None, name: str, options: RenderOptions) -> None:
    """Show the background, and that the shader of the model `name` is being compiled, which may take half a minute."""
    red, green, blue = default("background_bottom") if options.background is None else options.background[1]
    with context as gl:
        gl.screen.use()
        gl.screen.clear(red, green, blue)
        if gui is not None:
            gui.build_notice(f"{name}: compiling the shader")
            gui.draw()
        glfw.swap_buffers(context.handle)
