"""The page's rays take the steps of oracles/march.py, with the grid of cells that the page computes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.field.cells import Cells
from mplicits.ir.lower import lower
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.facts import CELLS
from oracles.march import march
from support.browser import visit
from support.changed_page import changed_page
from support.page_pictures import MODEL, remembering

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SIDE, COUNT = 48, 64
"""Pixels along each side of the picture; cells along each edge of the grid."""
CAMERA = Camera(30, 20, 3)
FOUND = "this.scene.cells = cells;"
TRACE = """
window.grid = cells.count;
window.trace = async (shading) => {
    const {painter, scene, current} = this, {gl} = painter.device, seen = new Float32Array(4 * SIDE * SIDE);
    painter.draw(current, uniforms(withOptions(scene, {shading}), null, [SIDE, SIDE]), [0, 0], [SIDE, SIDE]);
    await painter.device.done();
    gl.bindFramebuffer(gl.FRAMEBUFFER, painter.tile.framebuffer);
    gl.readPixels(0, 0, SIDE, SIDE, gl.RGBA, gl.FLOAT, seen);
    return [...seen];
};""".replace("SIDE", str(SIDE))
"""Lets a page with a grid return one sample of each pixel; with the shading "data", the ends of its rays."""


def samples(browser: "Browser", folder: Path, storage: str, shading: str) -> NDArray[np.float32]:
    """Return a sample of each pixel of MODEL's page, (SIDE, SIDE, 4), top row first. storage: of the weights."""
    (folder / "page.html").write_text(
        changed_page(MODEL, [(FOUND, FOUND + TRACE)], poster=False, shade="phong"), encoding="utf-8"
    )
    at = f"#panel=0&az={CAMERA.azimuth}&el={CAMERA.elevation}&d={CAMERA.distance}"
    with visit(browser, folder / "page.html", (SIDE, SIDE), 1, script=remembering(MODEL, storage), hash_=at) as visited:
        visited.until(f"window.grid === {COUNT} && document.documentElement.dataset.storage === '{storage}'")
        visited.still()
        seen = visited.page.evaluate(f"() => window.trace({shading!r})")
        assert visited.console == []
    return np.reshape(np.array(seen, np.float32), (SIDE, SIDE, 4))[::-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("storage", "late"), [("texture", True), pytest.param("literal", False, marks=pytest.mark.slow)]
)
def test_rays_take_the_steps_of_the_reference(
    storage: str, late: bool, browser: "Browser", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one draw, from a texture, a step precedes Newton's; in passes, Newton's comes first."""
    monkeypatch.setitem(CELLS, "last", COUNT)
    drawn = samples(browser, tmp_path, storage, "data").reshape(-1, 4)
    program = lower(MODEL)
    eye, directions, footprint = CAMERA.rays(SIDE, SIDE)
    rays = march(
        program,
        eye,
        directions.reshape(-1, 3),
        len(program.bands),
        footprint,
        schedule="relaxed",
        cells=Cells(program, COUNT),
        newton_steps=1,
        late=late,
    )
    hit = drawn[:, 3] > 0.5
    assert (rays.hit == hit).mean() > 0.999
    assert (rays.steps == drawn[:, 1])[hit].mean() > 0.97, "rounding may move f across a threshold"
    assert np.abs(rays.t - drawn[:, 0])[rays.hit & hit].mean() < 1e-4


@pytest.mark.slow
def test_the_floor_around_the_shape_is_in_shade(
    browser: "Browser", osmesa: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rays that Newton's step has brought near the shape, and that then miss it."""
    monkeypatch.setitem(CELLS, "last", COUNT)
    drawn = samples(browser, tmp_path, "texture", "softbox")
    theirs = Renderer(osmesa, bake(MODEL)).render((SIDE, SIDE), CAMERA, RenderOptions(shade="softbox"))
    floor = (drawn[..., 3] < 0.5) & (theirs[..., 3] < 0.5)
    assert np.abs(drawn - theirs)[floor].max() < 0.03
