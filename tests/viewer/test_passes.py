"""Drawing in passes: the same picture as a single draw, up to rounding and the interpolated floor of the studio."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.field.cells import NEAR, NEAR_IN_FILE
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.edges import Edges
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.triangles import Triangles
from support.paths import DEMO
from support.random_model import random_model

SIZE = (40, 32)
CAMERA = Camera(30, 20)


@pytest.fixture(scope="module")
def model() -> Model:
    return random_model((8, 0), (8, 0), texture=(8, 0))


@pytest.fixture(scope="module")
def both(osmesa: Context, model: Model) -> Iterator[tuple[Renderer, Renderer]]:
    """The same shader, without a grid of cells, in passes and in one draw, with equal step lengths."""
    shader = replace(bake(model, "literal", passes=True), cells=None)
    alone, in_passes = (f"const float NEAR = {near};" for near in (NEAR_IN_FILE, NEAR))
    assert shader.text.count(alone) == 1
    at_once = replace(shader, passes=None, text=shader.text.replace(alone, in_passes))
    renderers = Renderer(osmesa, shader), Renderer(osmesa, at_once)
    yield renderers
    for renderer in renderers:
        renderer.release()


def assert_alike(passes: NDArray[np.float32], at_once: NDArray[np.float32]) -> None:
    """Compare pictures of two programs, which may round differently at grazing rays."""
    assert np.isclose(passes, at_once, rtol=1e-3, atol=1e-3).all(axis=-1).mean() > 0.997


@pytest.mark.parametrize(
    "options",
    [
        *(RenderOptions(shade=shading) for shading in ("phong", "normal", "depth", "steps", "texture", "data")),
        RenderOptions(schedule="plain", samples=4, uniform=True, transparent=True),
        RenderOptions(level=1, normal_level=2, split_at=0.5, plain=True),
    ],
)
def test_passes_draw_the_same_picture_as_one_draw(both: tuple[Renderer, Renderer], options: RenderOptions) -> None:
    for camera in (CAMERA, Camera(30, 20, 1.3)):
        passes, at_once = (renderer.render(SIZE, camera, options) for renderer in both)
        assert at_once[..., 3].mean() > 0.05
        assert_alike(passes, at_once)


def test_passes_draw_nearly_the_same_studio_floor_as_one_draw(both: tuple[Renderer, Renderer]) -> None:
    for camera in (CAMERA, Camera(30, 20, 1.3)):
        passes, at_once = (renderer.render(SIZE, camera, RenderOptions(shade="softbox")) for renderer in both)
        hit = at_once[..., 3] > 0
        assert hit.mean() > 0.05
        assert_alike(passes[hit], at_once[hit])
        np.testing.assert_allclose(passes[~hit], at_once[~hit], atol=0.03)


@pytest.fixture(scope="module")
def newton_steps(osmesa: Context) -> Iterator[list[Renderer]]:
    """Renderers of one model: with Newton's step and packed rays, with Newton's step, with neither."""
    shader = bake(load(DEMO), "texture", passes=True)
    assert shader.newton_first
    renderers = []
    for software, looks in ((True, True), (False, True), (False, False)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Context, "software", software)
            renderers.append(Renderer(osmesa, replace(shader, newton_first=looks)))
    yield renderers
    for renderer in renderers:
        renderer.release()


@pytest.mark.parametrize(("shading", "samples"), [("phong", 4), ("softbox", 1), ("data", 1)])
def test_newton_steps_and_packing_keep_the_picture(newton_steps: list[Renderer], shading: str, samples: int) -> None:
    options = RenderOptions(shade=shading, samples=samples)
    pictures = [renderer.render(SIZE, CAMERA, options) for renderer in newton_steps]
    *looked, plain = pictures
    assert plain[..., 3].mean() > 0.05
    for picture in looked:
        assert not np.array_equal(picture, plain)
        assert ((picture[..., 3] > 0) == (plain[..., 3] > 0)).mean() > 0.998
        both = np.minimum(picture[..., 3], plain[..., 3]) > 0
        if shading == "data":
            assert (picture[..., 1] < plain[..., 1])[both].any()
            pixels = np.abs(picture - plain)[..., 0] / (2 / (CAMERA.focal * SIZE[1]) * np.maximum(plain[..., 0], 1e-6))
            assert np.quantile(pixels[both], 0.9) < 0.1
        else:
            assert np.quantile(np.abs(picture - plain)[both].max(axis=-1), 0.95) < 0.03


def test_a_tile_may_lie_anywhere_in_a_larger_target(both: tuple[Renderer, Renderer], osmesa: Context) -> None:
    pictures = []
    with osmesa as gl:
        target = gl.framebuffer([gl.texture((64, 48), 4, dtype="f4")], gl.depth_renderbuffer((64, 48)))
        for renderer in both:
            target.clear(0.25, 0.25, 0.25, 0.25)
            renderer.prepare(SIZE, CAMERA, RenderOptions())
            renderer.draw(target, (4, 8, 20, 24), (30, 11))
            pictures.append(np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(48, 64, 4))
        target.color_attachments[0].release()
        target.depth_attachment.release()
        target.release()
    assert_alike(pictures[0], pictures[1])
    assert (pictures[0][:11] == 0.25).all(), "nothing is drawn beside the tile"
    assert not (pictures[0][11:35, 30:50] == 0.25).any()


def test_mesh_edges_lie_over_all_passes(both: tuple[Renderer, Renderer], osmesa: Context) -> None:
    corners = np.array([(-1, -1, 0), (1, -1, 0.2), (0, 1, -0.2)], np.float32)
    edges = Edges(osmesa, Triangles(corners, np.zeros((3, 3), np.float32), np.array([(0, 1, 2)], np.int32)))
    without = both[0].render(SIZE, CAMERA)
    for renderer in both:
        renderer.edges = edges
    passes, at_once = (renderer.render(SIZE, CAMERA) for renderer in both)
    for renderer in both:
        renderer.edges = None
    edges.release()
    assert_alike(passes, at_once)
    drawn = (passes != without).any(axis=-1)
    assert drawn[without[..., 3] > 0.5].any()
    assert drawn[without[..., 3] < 0.5].any(), "beside the shape too"


def test_rays_that_meet_no_cell_take_no_steps(osmesa: Context, model: Model) -> None:
    shader = bake(model, "literal", passes=True)
    renderer = Renderer(osmesa, shader)
    far = Camera(30, 20, 9.0)
    picture = renderer.render(SIZE, far, RenderOptions(shade="data"))
    renderer.release()
    missed = picture[..., 1] == 0
    assert 0.3 < missed.mean() < 1.0
    assert (picture[missed][:, 2:] == 0).all()


def test_mixed_storage_draws_the_picture_of_literals(
    both: tuple[Renderer, Renderer], osmesa: Context, model: Model
) -> None:
    shader = replace(bake(model, "mixed", passes=True), cells=None)
    assert shader.passes is not None
    assert "mat4(" in shader.passes["trace"][0]
    assert "block(" in shader.passes["color"][0]
    renderer = Renderer(osmesa, shader)
    mixed, literal = (one.render(SIZE, CAMERA) for one in (renderer, both[0]))
    renderer.release()
    assert_alike(mixed, literal)
