"""Sphere tracing of the gallery's Spot against pyrender's picture of the curved mesh: silhouette, depth and color."""

import os
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.gallery import model_path
from mplicits.model.model_file import load
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.creases import corner_normals
from mplicits.trainer.shapes.curved import curved
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support import needs
from support.paths import DATA

os.environ.setdefault("PYOPENGL_PLATFORM", "osmesa")
SPOT = DATA / "textured" / "spot.obj"
SIZE = (384, 384)
CAMERA = Camera(40, 20)


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


def curved_spot() -> trimesh.Trimesh:
    """Spot as `train` takes it: curved, and cut into small triangles with the colors of the mesh."""
    mesh: trimesh.Trimesh = trimesh.load_mesh(SPOT, process=False)
    visual: Any = mesh.visual
    uv = np.asarray(visual.uv)[mesh.faces]
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    facets = curved(vertices, faces, corner_normals(vertices, faces, CREASE))
    corners = facets.vertices[facets.faces].reshape(-1, 3)
    of_corners = np.einsum("fkc,fci->fki", facets.weights, uv[facets.parents]).reshape(-1, 2)
    make_visual: Any = trimesh.visual.TextureVisuals
    visual = make_visual(uv=of_corners, material=visual.material)
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), visual=visual, process=False)


@needs.data(SPOT)
@pytest.mark.slow
def test_spot_matches_its_mesh_in_silhouette_depth_and_color(osmesa: Context) -> None:
    model = load(model_path("spot-large"))
    assert len(model.levels) == 3
    reference = PyrenderMesh(curved_spot(), model.center, model.scale, SIZE)
    mesh_color, mesh_depth = reference(CAMERA)
    reference.release()
    renderer = Renderer(osmesa, bake(model, "texture"))
    data = renderer.render(SIZE, CAMERA, RenderOptions(shade="data"))
    color = renderer.render(SIZE, CAMERA, RenderOptions(shade="texture"))[..., :3]
    renderer.release()

    hit, inside = data[..., 3] > 0.5, mesh_depth > 0
    both = hit & inside
    assert 0.1 < inside.mean() < 0.6
    assert both.sum() / (hit | inside).sum() >= 0.995
    back = CAMERA.matrix()[:3, 2].astype(np.float64)
    depth = data[..., 0] * -(CAMERA.rays(*SIZE)[1] @ back)
    assert np.median(np.abs(depth - mesh_depth)[both]) < 1e-3
    assert np.quantile(np.abs(depth - mesh_depth)[both], 0.98) < 0.01
    assert ((color - mesh_color) ** 2)[both].mean() < 0.0033, "a tenth of the paper's"
