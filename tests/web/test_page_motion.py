"""The page of a model that moves: its slider, its play button, and the picture at a time."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.page import standalone
from support.browser import Visit, visit
from support.moving_model import moving_model
from support.page_pictures import desktop, differ, remembering

if TYPE_CHECKING:
    from playwright.sync_api import Browser

MODEL = moving_model((16, 24))


@pytest.fixture(scope="module")
def moving(browser: "Browser", tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    """The page of MODEL, at the time in its hash."""
    path = tmp_path_factory.mktemp("page") / "moving.html"
    path.write_text(standalone(MODEL, poster=False, shade="phong"))
    with visit(browser, path, share=0.1, script=remembering(MODEL, "texture"), hash_="#t=0.6") as visited:
        visited.still()
        yield visited
        assert visited.console == []


def time_of(moving: Visit) -> float:
    return float(moving.page.input_value("#time"))


@pytest.mark.slow
def test_the_page_draws_a_time_as_osmesa_does(moving: Visit, osmesa: Context) -> None:
    renderer = Renderer(osmesa, bake(MODEL))
    assert time_of(moving) == pytest.approx(0.6)
    assert float(moving.root("error") or "nan") < 5e-6, "probes are of time 0"
    theirs = {time: desktop(renderer, Camera(), RenderOptions(time=time), side=64) for time in (0.6, 1.0)}
    renderer.release()
    ours = moving.saved()
    # A small picture: a larger share of the pixels lies on silhouettes.
    assert not differ(ours, theirs[0.6], mean=1.2)
    assert differ(ours, theirs[1.0], mean=1.2)
    moving.page.fill("#time", "1")
    assert moving.page.inner_text("#instant") == "1.00"
    moving.until("location.hash.endsWith('&t=1')")
    assert not differ(moving.saved(), theirs[1.0], mean=1.2)


@pytest.mark.slow
def test_space_and_the_button_play_and_pause(moving: Visit) -> None:
    moving.page.focus("#view")
    moving.page.keyboard.press(" ")
    assert moving.page.inner_text("#play") == "Pause"
    before = time_of(moving)
    moving.until(f"Math.abs(document.getElementById('time').value - {before}) > 0.05")
    assert moving.root("state") != "still"
    moving.page.click("#play")
    assert moving.page.inner_text("#play") == "Play"
    stopped = time_of(moving)
    moving.still()
    assert time_of(moving) == stopped
    assert float(moving.camera()["t"]) == pytest.approx(stopped, abs=1e-3)
    moving.page.focus("#play")
    moving.page.keyboard.press(" ")
    assert moving.root("playing") == "", "the button handles its own key only once"
    moving.page.fill("#time", "0.25")
    assert moving.root("playing") is None, "setting a time stops the motion"
    moving.still()


@pytest.mark.slow
def test_the_time_bar_is_large_enough_for_fingers_and_hidden_without_motion(moving: Visit, opened: Visit) -> None:
    box = moving.page.locator("#play").bounding_box()
    assert box is not None
    assert min(box["width"], box["height"]) >= 44
    assert moving.page.is_visible("#time")
    assert not opened.page.is_visible("#moment")
