"""A desk under OSMesa, shared by the tests of the desk."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from mplicits.model.model import save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state.desk import Desk
from mplicits.viewer.state.source import open_source
from mplicits.viewer.state.view import View
from numpy.typing import NDArray

from support.random_model import random_model

AREA = (24, 16)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture
def make(osmesa: Context, tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    desks = []

    def opened(watch: bool = False, **options: object) -> Desk:
        path = tmp_path / "two.safetensors"
        save(random_model((4, 0), (8, 0), texture=(4, 0), name="two"), path)
        source = open_source(path)
        view = View(Camera(), RenderOptions(**options), source.shader.levels, source.textured)  # type: ignore[arg-type]
        view.resize(AREA)
        desks.append(Desk(osmesa, source, view, watch=watch))
        return desks[-1]

    yield opened
    for desk in desks:
        desk.close()


def settle(desk: Desk, until: Callable[[], bool] = lambda: True, seconds: float = 60.0) -> int:
    """Ticks until nothing is due but a message's end; returns how many it took."""
    end, count = time.perf_counter() + seconds, 0
    while time.perf_counter() < end:
        due = desk.tick(AREA)
        count += 1
        if until() and desk.resting:
            return count
        time.sleep(min(0.02, due or 0.0))
    pytest.fail("it never comes to rest")


def is_open(desk: Desk, path: Path) -> bool:
    return desk.source.path == path


def shown(desk: Desk) -> NDArray[np.float32]:
    """(H, W, 3): the refined picture, top row first, in [0, 1]."""
    width, height = AREA
    with desk.context as gl:
        screen = gl.framebuffer([gl.texture(AREA, 4, dtype="f4")])
        desk.picture.show((0, 0), AREA, split=False, onto=screen)
        data = np.frombuffer(screen.read(components=3, dtype="f4"), np.float32)
        screen.color_attachments[0].release()
        screen.release()
    return data.reshape(height, width, 3)[::-1]
