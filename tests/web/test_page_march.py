"""The page's rays take the steps of oracles/march.py, with the grid of cells that the page computes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.field.cells import Cells
from mplicits.ir.lower import lower
from mplicits.viewer.draw.camera import Camera
from mplicits.web.facts import CELLS
from mplicits.web.page import standalone
from oracles.march import march
from support.browser import visit
from support.page_pictures import MODEL, remembering

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SIDE, COUNT = 48, 64
"""Pixels along each side of the picture; cells along each edge of the grid."""
CAMERA = Camera(30, 20, 3)
FOUND = "this.scene.cells = cells;"
TRACE = """
window.grid = cells.count;
window.trace = async () => {
    const {painter, scene, current} = this, {gl} = painter.device, seen = new Float32Array(4 * SIDE * SIDE);
    painter.draw(current, uniforms(withOptions(scene, {shading: "data"}), null, [SIDE, SIDE]), [0, 0], [SIDE, SIDE]);
    await painter.device.done();
    gl.bindFramebuffer(gl.FRAMEBUFFER, painter.tile.framebuffer);
    gl.readPixels(0, 0, SIDE, SIDE, gl.RGBA, gl.FLOAT, seen);
    return [...seen];
};""".replace("SIDE", str(SIDE))
"""Lets a page with a grid return the ends of its rays."""


@pytest.mark.parametrize(
    ("storage", "late"), [("texture", True), pytest.param("literal", False, marks=pytest.mark.slow)]
)
def test_rays_take_the_steps_of_the_reference(
    storage: str, late: bool, browser: "Browser", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one draw, from a texture, a step precedes the first look; in passes, the first look comes first."""
    monkeypatch.setitem(CELLS, "last", COUNT)
    text = standalone(MODEL, poster=False, shade="phong")
    assert text.count(FOUND) == 1
    (tmp_path / "page.html").write_text(text.replace(FOUND, FOUND + TRACE))
    at = f"#panel=0&az={CAMERA.azimuth}&el={CAMERA.elevation}&d={CAMERA.distance}"
    with visit(
        browser, tmp_path / "page.html", (SIDE, SIDE), 1, script=remembering(MODEL, storage), hash_=at
    ) as visited:
        visited.until(f"window.grid === {COUNT} && document.documentElement.dataset.storage === '{storage}'")
        visited.still()
        seen = visited.page.evaluate("() => window.trace()")
        assert visited.console == []
    drawn = np.reshape(seen, (SIDE, SIDE, 4))[::-1].reshape(-1, 4)
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
        first_looks=1,
        late=late,
    )
    hit = drawn[:, 3] > 0.5
    assert (rays.hit == hit).mean() > 0.999
    assert (rays.steps == drawn[:, 1])[hit].mean() > 0.97, "rounding may move f across a threshold"
    assert np.abs(rays.t - drawn[:, 0])[rays.hit & hit].mean() < 1e-4
