"""The page of a scene holds its field as text and texels, and draws and plays as the desktop does."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.codegen.targets import glsl300es, glsl330
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.page import page_of, standalone
from support.browser import visit
from support.page_pictures import desktop, differ
from support.scene_models import SMALL, STILL, composed

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def test_the_page_of_a_scene_holds_the_field_that_glsl300es_has(tmp_path: Path) -> None:
    model = composed(tmp_path, STILL, (4, 8))
    (page, _), shader = page_of(model, poster=False), glsl300es.bake(model)
    scene = page.facts["scene"]
    assert scene["text"] in shader.text
    assert scene["shapes"] == 6
    assert list(scene["loops"]["value"]) == list(shader.value_loops)
    texels = np.frombuffer(page.data, f"<f{scene['size']}").reshape(-1, 4)
    assert len(texels) == scene["texels"]
    assert shader.weights is not None
    np.testing.assert_array_equal(texels, shader.weights.reshape(-1, 4)[: len(texels)])


@pytest.mark.slow
def test_the_page_of_a_scene_draws_a_time_as_osmesa_does(browser: "Browser", osmesa: Context, tmp_path: Path) -> None:
    model = composed(tmp_path, SMALL)
    (tmp_path / "scene.html").write_text(standalone(model, shade="phong"))
    renderer = Renderer(osmesa, glsl330.bake(model, passes=True))
    theirs = {time: desktop(renderer, Camera(), RenderOptions(time=time), side=64) for time in (0.3, 1.0)}
    renderer.release()
    with visit(browser, tmp_path / "scene.html", share=0.1, hash_="#t=0.3") as visited:
        visited.still()
        assert float(visited.root("error") or "nan") < 5e-6
        assert visited.page.inner_text("#shapes").startswith("2 shapes · ")
        ours = visited.saved()
        # A small picture: a larger share of the pixels lies on silhouettes.
        assert not differ(ours, theirs[0.3], mean=1.2)
        assert differ(ours, theirs[1.0], mean=1.2)
        visited.page.click("#play")
        visited.until("Number(document.getElementById('time').value) > 0.35")
        assert visited.console == []
