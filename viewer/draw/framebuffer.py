"""Helpers for moderngl's framebuffers: create, free, read, check, mask."""

import moderngl
import numpy as np

from ...model.errors import UserError
from .supersampling import Image


def new_framebuffer(gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    """Return an RGBA32F framebuffer with a depth buffer, `size` (width, height)."""
    new = gl.framebuffer([gl.texture(size, 4, dtype="f4")], gl.depth_renderbuffer(size))
    _ = gl.error  # moderngl binds the previous framebuffer again, which may be gone; a bad framebuffer raises
    new.use()
    return new


def free(framebuffer: moderngl.Framebuffer) -> None:
    """Release a framebuffer and its attachments, which moderngl does not release."""
    for attachment in (*framebuffer.color_attachments, framebuffer.depth_attachment):
        if attachment is not None:
            attachment.release()
    framebuffer.release()


def texture_of(framebuffer: moderngl.Framebuffer) -> moderngl.Texture:
    """Return the framebuffer's color texture."""
    texture = framebuffer.color_attachments[0]
    assert isinstance(texture, moderngl.Texture)
    return texture


def read_pixels(target: moderngl.Framebuffer, size: tuple[int, int], corner: tuple[int, int] = (0, 0)) -> Image:
    """Return `size` (width, height) pixels from the corner (x, y) on: (H, W, 4) float32, bottom row first."""
    data = target.read(viewport=(*corner, *size), components=4, dtype="f4")
    return np.frombuffer(data, np.float32).reshape(size[1], size[0], 4)


def check_drawn(gl: moderngl.Context, driver: str) -> None:
    """Wait until drawing is done. Raises UserError if the driver, of this name, reports an error."""
    gl.finish()
    if (problem := gl.error) != "GL_NO_ERROR":
        raise UserError(f"{driver} fails to draw ({problem}); try a smaller --size, or --context osmesa")


def set_color_mask(framebuffer: moderngl.Framebuffer, mask: tuple[bool, bool, bool, bool]) -> None:
    """Choose which channels are written, and bind the framebuffer: moderngl sets the mask when it binds."""
    framebuffer.color_mask = mask
    framebuffer.use()
