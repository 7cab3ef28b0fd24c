"""What moderngl leaves to do around framebuffers."""

import moderngl
import numpy as np

from ...model.errors import UserError
from .supersampling import Image


def free(framebuffer: moderngl.Framebuffer) -> None:
    """Releases a framebuffer and what is attached to it."""
    for attachment in (*framebuffer.color_attachments, framebuffer.depth_attachment):
        if attachment is not None:
            attachment.release()
    framebuffer.release()


def read(target: moderngl.Framebuffer, size: tuple[int, int]) -> Image:
    """(H, W, 4) of the lower left corner, `size` (width, height), bottom row first."""
    data = target.read(viewport=(0, 0, *size), components=4, dtype="f4")
    return np.frombuffer(data, np.float32).reshape(size[1], size[0], 4)


def check_drawn(gl: moderngl.Context, driver: str) -> None:
    """Waits for the driver. Raises UserError where it could not draw."""
    gl.finish()
    if (problem := gl.error) != "GL_NO_ERROR":
        raise UserError(f"{driver} fails to draw ({problem}); try a smaller --size, or --context osmesa")


def set_color_mask(framebuffer: moderngl.Framebuffer, mask: tuple[bool, bool, bool, bool]) -> None:
    """Which channels are written; moderngl tells GL so only when a framebuffer is bound."""
    framebuffer.color_mask = mask
    framebuffer.use()
