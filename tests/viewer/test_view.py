"""Keys and the pointer change the view."""

import numpy as np
import pytest

from mplicits.codegen.targets.motion import PERIOD
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.state.view import SCALES, SLOW_FRAME, View


@pytest.fixture
def view() -> View:
    """A view of a textured model of two levels."""
    view = View(Camera(10, 20, 3.0), RenderOptions(), levels=2, textured=True)
    view.changed = False
    return view


def test_dragging_turns_and_pans(view: View) -> None:
    view.turn(0.5, 0.1)
    assert (view.camera.azimuth, view.camera.elevation) == (280.0, 2.0)
    assert view.changed
    assert view.moved
    before = view.camera
    view.pan(0.5, 0.0)
    center = np.array([*before.target, 1.0])
    seen = np.linalg.inv(view.camera.matrix()) @ center
    assert abs(seen[0] / -seen[2] * view.camera.focal - 1.0) < 1e-5, (
        "the target has followed the pointer half a height to the right"
    )


def test_the_wheel_zooms(view: View) -> None:
    view.zoom(1)
    assert view.camera.away < 3.0
    view.zoom(-1)
    assert abs(view.camera.away - 3.0) < 1e-9


def test_keys_change_the_shading_the_level_and_the_camera(view: View) -> None:
    for key, shading in (("N", "normal"), ("D", "depth"), ("X", "steps"), ("T", "texture"), ("P", "phong")):
        view.key(key)
        assert view.options.shade == shading
    view.key("1")
    assert (view.options.level, view.options.normal_level) == (1, 1)
    view.key("3")
    view.key("0")
    assert view.options.level == 1, "the model has 2 levels"
    view.key("B")
    assert view.split == 2
    right = view.scene((8, 8)).right
    assert right is not None
    assert (right.level, right.normal_level) == (2, 2)
    view.key("B")
    assert view.scene((8, 8)).right is None
    view.key("LEFT")
    view.turn(1, 1)
    view.key("R")
    assert view.camera == Camera(10, 20, 3.0)
    view.key("+")
    assert view.camera.away < 3.0


def test_space_starts_and_stops_the_turntable(view: View) -> None:
    view.key("SPACE")
    assert view.turntable
    view.spin(2.0)
    assert view.camera.azimuth == 70.0
    view.key("SPACE")
    assert not view.turntable


def test_a_view_adapts_to_a_model_without_texture(view: View) -> None:
    view.set(shade="texture", level=2)
    view.adapt(levels=1, textured=False, moves=False)
    assert (view.options.shade, view.options.level) == ("phong", None)
    view.key("T")
    assert view.options.shade == "phong"


def test_a_new_window_size_fits_the_shape() -> None:
    view = View(Camera(), RenderOptions(), levels=1, textured=False)
    wide = view.camera.away
    view.resize((100, 400))
    assert view.camera.away > 2 * wide
    view.resize((0, 0))
    assert view.scene((0, 0)).size == (1, 1)


def test_slow_frames_get_fewer_pixels_and_fast_ones_more(view: View) -> None:
    for _ in range(20):
        view.timed(2 * SLOW_FRAME)
    assert view.scale == SCALES[-1]
    for _ in range(20):
        view.timed(SLOW_FRAME / 100)
    assert view.scale == 1.0
    view.timed(SLOW_FRAME / 2)
    assert view.scale == 1.0, "such a frame is neither slow nor fast"


def test_the_key_m_cycles_the_modes_of_a_mesh(view: View) -> None:
    seen = []
    for _ in range(5):
        seen.append(view.mesh)
        view.key("M")
    assert seen == ["hidden", "edges", "faces", "faces and edges", "hidden"]
    assert view.changed


def test_space_plays_and_pauses_a_motion_there_and_back() -> None:
    view = View(Camera(), RenderOptions(time=0.5), levels=1, textured=False, moves=True)
    assert view.phase == pytest.approx(0.25)
    view.key("SPACE")
    assert (view.playing, view.turntable, view.animated) == (True, False, True)
    times = []
    for _ in range(4):
        view.play(PERIOD / 4)
        times.append(view.options.time)
    assert times == pytest.approx([1.0, 0.5, 0.0, 0.5])
    view.key("SPACE")
    assert not view.animated
    view.changed = view.moved = False
    view.seek(0.2)
    assert (view.options.time, view.changed, view.moved) == (0.2, True, True)
    view.adapt(levels=1, textured=False, moves=False)
    assert (view.options.time, view.moves) == (0.0, False)
    view.key("SPACE")
    assert (view.playing, view.turntable) == (False, True)
