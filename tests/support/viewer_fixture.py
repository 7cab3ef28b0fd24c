"""Viewers that draw with OSMesa, and helpers for their tests."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.model.model_file import save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state.source import open_source
from mplicits.viewer.state.view import View
from mplicits.viewer.state.viewer import Viewer
from support.fitted_model import fitted_model

AREA = (24, 16)
"""(width, height) of the picture in pixels."""
TWO = replace(fitted_model((4, 8)), name="two")
"""A textured model of two levels."""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
"""An OBJ file."""


OpenViewer = Callable[..., Viewer]
"""Type of the fixture `open_viewer`."""


@pytest.fixture
def open_viewer(osmesa: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[OpenViewer]:
    """A function that opens a viewer of TWO, whose messages stay."""
    monkeypatch.setattr("mplicits.viewer.state.viewer.MESSAGE_SECONDS", math.inf)
    viewers = []

    def opened(watch: bool = False, **options: object) -> Viewer:
        path = tmp_path / "two.safetensors"
        save(TWO, path)
        source = open_source(path)
        view = View(Camera(), RenderOptions(**options), source.shader.levels, source.textured)  # type: ignore[arg-type]
        view.resize(AREA)
        viewers.append(Viewer(osmesa, source, view, watch=watch))
        return viewers[-1]

    yield opened
    for viewer in viewers:
        viewer.close()


def settle(viewer: Viewer, until: Callable[[], bool] = lambda: True) -> None:
    """Call tick until the condition holds and the viewer is idle; fail after five minutes."""
    end = time.perf_counter() + 300
    while time.perf_counter() < end:
        due = viewer.tick(AREA)
        if until() and viewer.idle:
            return
        time.sleep(min(0.02, due or 0.0))
    pytest.fail("the viewer never becomes idle")


def is_open(viewer: Viewer, path: Path) -> bool:
    """Return whether the viewer shows this file."""
    return viewer.source.path == path


def picture_of(viewer: Viewer) -> NDArray[np.float32]:
    """Return the viewer's picture: (H, W, 3) float32 in [0, 1], top row first."""
    width, height = AREA
    with viewer.context as gl:
        screen = gl.framebuffer([gl.texture(AREA, 4, dtype="f4")])
        viewer.drawing.picture.show((0, 0), AREA, split=False, onto=screen)
        data = np.frombuffer(screen.read(components=3, dtype="f4"), np.float32)
        screen.color_attachments[0].release()
        screen.release()
    return data.reshape(height, width, 3)[::-1]
