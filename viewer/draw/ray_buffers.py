"""Textures that the passes of a frame hand on: ray states and normals."""

import moderngl

from .framebuffer import free, new_framebuffer, read_pixels, texture_of
from .program import UNITS
from .supersampling import Image
from .tiles import Tile


class RayBuffers:
    """Framebuffers of one size that share a depth buffer, in the context `gl`.

    Their sides are powers of two: software GL compiles programs again for textures of other sizes.
    """

    rays: moderngl.Framebuffer
    """Output of mask_near.glsl and trace.glsl."""
    normals: moderngl.Framebuffer
    """Output of gradient.glsl."""
    outputs: dict[str, moderngl.Framebuffer]
    """The framebuffer of each pass that writes rays, normals, or only depth."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int]) -> None:
        """size: least (width, height)."""
        size = 1 << (size[0] - 1).bit_length(), 1 << (size[1] - 1).bit_length()
        self.rays = new_framebuffer(gl, size)
        self.normals = gl.framebuffer([gl.texture(size, 4, dtype="f4")], self.rays.depth_attachment)
        depth = gl.framebuffer((), self.rays.depth_attachment)
        self.outputs = {"mask_near": self.rays, "trace": self.rays, "gradient": self.normals, "mask_unfinished": depth}

    def use(self, region: Tile) -> None:
        """Bind the textures to UNITS, and restrict drawing to a region."""
        texture_of(self.rays).use(UNITS["rays"])
        texture_of(self.normals).use(UNITS["normals"])
        for framebuffer in self.outputs.values():
            framebuffer.viewport = region

    def read(self, region: Tile) -> tuple[Image, Image]:
        """Return a region of the rays and of the normals."""
        return read_pixels(self.rays, region[2:], region[:2]), read_pixels(self.normals, region[2:], region[:2])

    def write(self, region: Tile, rays: Image, normals: Image) -> None:
        """Replace a region of the rays and of the normals."""
        texture_of(self.rays).write(rays.tobytes(), region)
        texture_of(self.normals).write(normals.tobytes(), region)

    def release(self) -> None:
        texture_of(self.normals).release()
        self.normals.release()
        self.outputs["mask_unfinished"].release()
        free(self.rays)
