"""What the passes of a frame leave to one another: where rays are, and the normals of those that have hit."""

import moderngl

from .framebuffer import free, new_framebuffer, read_pixels, texture_of
from .program import UNITS
from .supersampling import Image
from .tiles import Tile


class RayBuffers:
    """Framebuffers of one size that share a depth buffer, in the context of `gl`.

    Their sides are powers of two: software GL compiles programs again for textures of other sides.
    """

    rays: moderngl.Framebuffer
    """Of near.glsl and trace.glsl."""
    normals: moderngl.Framebuffer
    """Of normals.glsl."""
    depth: moderngl.Framebuffer
    """Of rest.glsl, which writes nothing else."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int]) -> None:
        """size: least width and height."""
        size = 1 << (size[0] - 1).bit_length(), 1 << (size[1] - 1).bit_length()
        self.rays = new_framebuffer(gl, size)
        self.normals = gl.framebuffer([gl.texture(size, 4, dtype="f4")], self.rays.depth_attachment)
        self.depth = gl.framebuffer((), self.rays.depth_attachment)

    def holds(self, width: int, height: int) -> bool:
        """Whether so many pixels fit."""
        return self.rays.width >= width and self.rays.height >= height

    def use(self, region: Tile) -> None:
        """Bind the textures to UNITS, and let drawing be into a region of them."""
        texture_of(self.rays).use(UNITS["rays"])
        texture_of(self.normals).use(UNITS["normals"])
        for framebuffer in (self.rays, self.normals, self.depth):
            framebuffer.viewport = region

    def read(self, region: Tile) -> tuple[Image, Image]:
        """Return what a region of the rays and of the normals holds."""
        return read_pixels(self.rays, region[2:], region[:2]), read_pixels(self.normals, region[2:], region[:2])

    def write(self, region: Tile, rays: Image, normals: Image) -> None:
        """Put a region of the rays and of the normals back."""
        texture_of(self.rays).write(rays.tobytes(), region)
        texture_of(self.normals).write(normals.tobytes(), region)

    def release(self) -> None:
        """Free everything."""
        texture_of(self.normals).release()
        self.normals.release()
        self.depth.release()
        free(self.rays)
