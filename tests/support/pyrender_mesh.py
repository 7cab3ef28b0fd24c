"""Unlit pictures of a textured mesh by pyrender on OSMesa. Our own contexts stay usable."""

import os
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from mplicits.viewer.draw.camera import Camera

os.environ.setdefault("PYOPENGL_PLATFORM", "osmesa")

NEAR, FAR = 0.05, 100.0
"""Clip planes, in model units."""
BACKGROUND = (1.0, 1.0, 1.0)
"""sRGB."""


class PyrenderMesh:
    """Draws a mesh, moved into model space, through the viewer's cameras.

    Model space is (the mesh's own - center) / scale. size: (width, height) of the pictures, in pixels.
    """

    def __init__(
        self, mesh: trimesh.Trimesh, center: tuple[float, float, float], scale: float, size: tuple[int, int]
    ) -> None:
        import pyrender
        from pyrender.constants import RenderFlags

        moved = mesh.copy()
        moved.vertices = (np.asarray(mesh.vertices) - center) / scale
        if isinstance(moved.visual, trimesh.visual.TextureVisuals):
            moved.visual.material.diffuse = np.full(4, 255, np.uint8)  # it multiplies the image; gray by default
        self._flags = RenderFlags.FLAT | RenderFlags.SKIP_CULL_FACES
        self._size = size
        self._scene: Any = pyrender.Scene(bg_color=(*BACKGROUND, 1.0))
        self._scene.add(pyrender.Mesh.from_trimesh(moved, smooth=False))
        self._camera = self._scene.add(pyrender.PerspectiveCamera(yfov=1.0, znear=NEAR, zfar=FAR))
        self._renderer: Any = pyrender.OffscreenRenderer(*size)
        self._renderer._platform.make_uncurrent()

    def __call__(self, camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Draw the mesh; pyrender averages four samples per pixel in sRGB.

        Returns colors (H, W, 3), sRGB in [0, 1], and depths along the view axis (H, W), in model units and 0 where
        there is no surface; the top row comes first.
        """
        self._camera.camera.yfov = float(np.radians(camera.fov))
        self._camera.camera.aspectRatio = self._size[0] / self._size[1]
        self._scene.set_pose(self._camera, camera.matrix().astype(np.float64))
        try:
            color, depth = self._renderer.render(self._scene, flags=self._flags)
        finally:
            self._renderer._platform.make_uncurrent()
        return np.asarray(color[..., :3], np.float64) / 255, np.asarray(depth, np.float64)

    def release(self) -> None:
        """Free the context."""
        self._renderer._platform.make_current()
        self._renderer.delete()
