"""Desks that draw under OSMesa, and what the tests of the desk do with them."""

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
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.source import open_source
from mplicits.viewer.state.view import View
from support.fitted_model import fitted_model

AREA = (24, 16)
"""(width, height) of the picture in pixels."""
TWO = replace(fitted_model((4, 8)), name="two")
"""A model of two levels with colours."""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
"""An OBJ file."""


@pytest.fixture
def open_desk(osmesa: Context, tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    """Give a function that opens a desk with a textured model of two levels, named "two"."""
    desks = []

    def opened(watch: bool = False, **options: object) -> Desk:
        path = tmp_path / "two.safetensors"
        save(TWO, path)
        source = open_source(path)
        view = View(Camera(), RenderOptions(**options), source.shader.levels, source.textured)  # type: ignore[arg-type]
        view.resize(AREA)
        desks.append(Desk(osmesa, source, view, watch=watch))
        return desks[-1]

    yield opened
    for desk in desks:
        desk.close()


def settle(desk: Desk, until: Callable[[], bool] = lambda: True, seconds: float = 60.0) -> None:
    """Call tick until the condition holds and the desk rests; fail after so many seconds."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        due = desk.tick(AREA)
        if until() and desk.resting:
            return
        time.sleep(min(0.02, due or 0.0))
    pytest.fail("the desk never comes to rest")


def is_open(desk: Desk, path: Path) -> bool:
    """Return whether the desk shows this file."""
    return desk.shown.source.path == path


def picture_of(desk: Desk) -> NDArray[np.float32]:
    """Return what the desk would put onto the screen: (H, W, 3) float32 in [0, 1], top row first."""
    width, height = AREA
    with desk.shown.context as gl:
        screen = gl.framebuffer([gl.texture(AREA, 4, dtype="f4")])
        desk.drawing.picture.show((0, 0), AREA, split=False, onto=screen)
        data = np.frombuffer(screen.read(components=3, dtype="f4"), np.float32)
        screen.color_attachments[0].release()
        screen.release()
    return data.reshape(height, width, 3)[::-1]
