"""Sphere tracing of the gallery's Spot against pyrender's picture of the curved mesh: silhouette, depth and color."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

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
from support.pyrender_mesh import PyrenderMesh

SPOT = DATA / "textured" / "spot.obj"
SIZE = (384, 384)
CAMERA = Camera(40, 20)


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


def test_pyrender_draws_a_square_of_known_size_depth_and_color(tmp_path: Path) -> None:
    square = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    square.visual = trimesh.visual.ColorVisuals(square, vertex_colors=[[51, 102, 204, 255]] * 4)
    reference = PyrenderMesh(square, (0.0, 0.0, 0.0), 2.0, (64, 32))
    color, depth = reference(Camera(0, 0, 4.0, fov=30.0))
    reference.release()
    pixels = 0.5 / (np.tan(np.radians(15)) * 4) * 16
    assert (depth > 0).sum() == pytest.approx((2 * pixels) ** 2, rel=0.15)
    np.testing.assert_allclose(depth[depth > 0], 4.0, rtol=1e-4)
    np.testing.assert_allclose(color[16, 32], np.array([51, 102, 204]) / 255, atol=1e-6)
    np.testing.assert_array_equal(color[0, 0], 1.0)
