"""createMesh in a scene of three.js: its picture equals that of a fine mesh, where a plane and a box cut both."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mplicits
from support.browser import PATIENCE, listen
from support.fitted_model import fitted_model
from support.module_pages import drawn, three_page
from support.moving_model import moving_model
from support.scene_models import STILL, composed

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

FIELD = mplicits.Field(fitted_model((24, 48)))
BACKGROUND, PLANE, BOX = (0x40, 0x54, 0x68), (0x9F, 0xB8, 0x9A), (0xD0, 0x48, 0x2A)


@contextmanager
def opened(
    browser: "Browser", folder: Path, field: mplicits.Field = FIELD, *, cells: int = 192, **setup: Any
) -> Iterator["Page"]:
    """Open the page of the scene with a model."""
    context = browser.new_context(offline=True)
    context.set_default_timeout(PATIENCE)
    page, messages = context.new_page(), list[str]()
    listen(page, messages)
    page.goto(three_page(field, folder, cells=cells, box=[0.8, 0.2, 0.4], **setup).as_uri())
    page.wait_for_function("() => window.draw")
    yield page
    context.close()
    assert messages == []


def pictures(browser: "Browser", folder: Path, **setup: Any) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Draw the scene with the traced model, and with its meshed copy."""
    with opened(browser, folder, **setup) as page:
        return drawn(page, True), drawn(page, False)


def labels(picture: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Say of each pixel whether it shows the background (0), the plane (1), the box (2) or the model (3)."""
    found = np.full(picture.shape[:2], 3)
    for label, color in enumerate((BACKGROUND, PLANE, BOX)):
        found[(np.abs(picture.astype(int) - color) <= 2).all(axis=-1)] = label
    return found


@pytest.mark.slow
@pytest.mark.parametrize("perspective", [True, False])
def test_silhouette_and_cuts_equal_those_of_a_mesh(browser: "Browser", tmp_path: Path, perspective: bool) -> None:
    traced, meshed = pictures(browser, tmp_path, perspective=perspective)
    ours, expected = labels(traced), labels(meshed)
    model = expected == 3
    assert all((expected == label).sum() > 300 for label in range(4))
    assert (ours != expected).sum() < 0.005 * model.sum()
    both = model & (ours == 3)
    wrong = np.abs(traced[both].astype(int) - meshed[both]).max(axis=1)
    assert np.quantile(wrong, 0.5) <= 2
    assert np.quantile(wrong, 0.95) <= 12


@pytest.mark.slow
def test_the_shadow_equals_that_of_a_mesh(browser: "Browser", tmp_path: Path) -> None:
    traced, meshed = (
        picture.astype(int).sum(axis=-1) for picture in pictures(browser, tmp_path, lit=True, ground=-1.1)
    )
    assert (np.abs(traced - meshed) > 60).mean() < 0.002


def test_a_raycaster_meets_the_surface(browser: "Browser", tmp_path: Path) -> None:
    with opened(browser, tmp_path, cells=64) as page:
        for x, y in ((0, 0), (-0.2, 0.1), (0.15, 0.2)):
            traced, *copies = page.evaluate("place => pick(...place)", [x, y])
            assert abs(traced - min(copies)) < 0.003
        assert page.evaluate("() => pick(0.9, 0.9)") == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["scene", "moving"])
def test_scenes_and_moving_models_are_drawn(browser: "Browser", tmp_path: Path, kind: str) -> None:
    model = composed(tmp_path, STILL) if kind == "scene" else moving_model((24, 32))
    with opened(browser, tmp_path, mplicits.Field(model), cells=96) as page:
        ours, expected = labels(drawn(page, True)), labels(drawn(page, False))
    assert (expected == 3).sum() > 2000
    assert (ours != expected).sum() < 0.03 * (expected == 3).sum(), "the mesh rounds the edges of a scene's plate"
