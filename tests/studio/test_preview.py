"""The studio's picture of a dropped mesh, in Chromium."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from support.browser import visit
from support.studio_visit import ready, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.mark.slow
def test_the_image_of_a_mesh_is_upright(browser: "Browser", tmp_path: Path) -> None:
    """The upper half of the image is red; texture coordinates of the ball grow upwards."""
    mesh: Any = trimesh.creation.icosphere(3)
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4, :, 0] = pixels[4:, :, 2] = 255
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(baseColorTexture=Image.fromarray(pixels))
    mesh.visual = visual.TextureVisuals(uv=0.5 + 0.49 * mesh.vertices[:, :2], material=material)
    with visit(browser, write_page(tmp_path / "studio.html", 100_000), size=(390, 844), share=0.1) as visited:
        ready(visited)
        visited.drop(mesh.export(file_type="glb"), "a ball.glb")
        visited.page.click("#pause")
        visited.page.check("#picture input[value=mesh]", force=True)
        for _ in range(3000):
            taken = Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB")
            middle = np.asarray(taken, np.float64)[:, taken.width // 2]
            red, blue = (np.flatnonzero(middle[:, k] > middle[:, 2 - k] + 60) for k in (0, 2))
            if len(red) and len(blue):
                break
            visited.page.wait_for_timeout(100)
    assert min(len(red), len(blue)) > 5
    assert red.max() < blue.min()
