"""Pictures of a small trained model against golden files: shading, tracing, supersampling, normal mapping."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.codegen.targets.glsl330 import bake
from mplicits.mesher.extract import extract_model, up_to
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.rasterizer import Rasterizer
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.screenshot import save_png
from mplicits.viewer.draw.triangles import Triangles
from support.paths import DEMO, GOLDEN, ROOT

FAILED = ROOT / "out" / "golden"
CAMERA = Camera(35, 25)
PICTURES = {
    "phong": RenderOptions(samples=4, uniform=True),
    "softbox": RenderOptions(shade="softbox", samples=4, uniform=True),
    "softbox-on-white": RenderOptions(shade="softbox", samples=4, uniform=True, background=((1, 1, 1), (1, 1, 1))),
    "normal": RenderOptions(shade="normal"),
    "depth": RenderOptions(shade="depth"),
    "steps": RenderOptions(shade="steps"),
    "texture": RenderOptions(shade="texture"),
    "texture-on-level-1": RenderOptions(shade="texture", level=1),
    "coarse": RenderOptions(level=1, normal_level=1),
    "normal-mapping": RenderOptions(level=1, normal_level=2),
}
MESH_PICTURES = {
    "mesh-own-normals": RenderOptions(samples=4, uniform=True, split_at=1.0),
    "mesh-neural-normals": RenderOptions(samples=4, uniform=True),
}
OFF = 16
"""Tolerance of a channel, of 255: CPUs round differently."""
FEW = 0.002
"""Largest share of pixels beyond the tolerance."""
MEAN = 0.2
"""Largest mean difference, of 255."""


@pytest.fixture(scope="module")
def renderer(osmesa: Context) -> Renderer:
    return Renderer(osmesa, bake(load(DEMO), passes=True))


@pytest.fixture(scope="module")
def low_poly(osmesa: Context) -> Rasterizer:
    """A rasterizer of level 1's mesh by marching cubes on a coarse grid."""
    model = load(DEMO)
    mesh = extract_model(up_to(model, 1), 32).mesh
    assert mesh.normals is not None
    return Rasterizer(osmesa, model, Triangles(mesh.vertices, mesh.normals, mesh.faces.astype(np.int32)), "texture")


def pixels(path: Path) -> NDArray[np.int16]:
    return np.asarray(Image.open(path), np.int16)


def compare(name: str, got: Path, want: Path) -> None:
    """Fail unless the picture `got` matches `want`, and write three magnified pictures."""
    got_pixels, want_pixels = pixels(got), pixels(want)
    assert got_pixels.shape == want_pixels.shape
    difference = np.abs(got_pixels - want_pixels)
    share, mean = float((difference.max(axis=-1) > OFF).mean()), float(difference.mean())
    if share <= FEW and mean <= MEAN:
        return
    FAILED.mkdir(parents=True, exist_ok=True)
    pictures = {"got": got_pixels, "want": want_pixels, "diff": np.minimum(difference * 8, 255)}
    for kind, picture in pictures.items():
        large = Image.fromarray(picture.astype(np.uint8))
        large.resize((4 * large.width, 4 * large.height), Image.Resampling.NEAREST).save(FAILED / f"{name}-{kind}.png")
    pytest.fail(
        f"{name}: {share:.2%} of pixels are off by more than {OFF} (allowed {FEW:.2%}), mean difference {mean:.2f} "
        f"(allowed {MEAN}); look at out/golden/{name}-got.png, -want.png and -diff.png (8 times the difference), "
        "and run pytest --update-golden where the new picture is right"
    )


@pytest.mark.parametrize("name", PICTURES | MESH_PICTURES)
def test_a_picture_matches_its_golden_picture(
    name: str, renderer: Renderer, low_poly: Rasterizer, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    got, want = tmp_path / f"{name}.png", GOLDEN / f"{name}.png"
    drawing = low_poly if name in MESH_PICTURES else renderer
    save_png(got, drawing.render((128, 128), CAMERA, (PICTURES | MESH_PICTURES)[name]))
    if request.config.getoption("--update-golden"):
        want.write_bytes(got.read_bytes())
    compare(name, got, want)
