"""The renderer: pictures, tiles, supersampling, options, uniforms, and errors."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shader import Shader
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.viewer.draw import tiles
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.supersampling import Image, to_linear
from support import needs
from support.fitted_model import fitted_model
from support.random_model import random_model

SIZE = (48, 40)
DATA = RenderOptions(shade="data")


@pytest.fixture(scope="module")
def model() -> Model:
    return fitted_model()


@pytest.fixture(scope="module")
def shader(model: Model) -> Shader:
    return bake(model)


@pytest.fixture(scope="module")
def renderer(osmesa: Context, shader: Shader) -> Iterator[Renderer]:
    renderer = Renderer(osmesa, shader)
    yield renderer
    renderer.release()


def linear(image: Image) -> Image:
    return to_linear(image, transparent=False)


def test_hits_lie_on_the_surface(renderer: Renderer, model: Model) -> None:
    camera = Camera(40, -25, 3.0)
    image = renderer.render(SIZE, camera, DATA)
    t, _steps, level, hit = np.moveaxis(image, -1, 0)
    eye, directions, footprint = camera.rays(*SIZE)
    points = (eye + t[..., None] * directions).astype(np.float32)
    inside = hit == 1
    assert 0.2 < inside.mean() < 0.6
    value = interpret.nested_field(lower(model), points[inside], 2)[0]
    assert np.abs(value).max() < 3.0 * footprint, "within a pixel at the camera's distance"
    assert set(np.unique(level)) <= {0, 1, 2}


def test_the_top_row_comes_first(renderer: Renderer) -> None:
    hit = renderer.render(SIZE, Camera(target=(0.0, 0.9, 0.0), elevation=0), DATA)[..., 3]
    assert hit[-1].any(), "the target is above the shape, which is in the lower half"
    assert not hit[: SIZE[1] // 3].any()


def test_the_right_of_the_scene_is_on_the_right_of_the_picture(renderer: Renderer) -> None:
    hit = renderer.render(SIZE, Camera(0, 0, target=(-0.9, 0.0, 0.0)), DATA)[..., 3]
    assert hit[:, SIZE[0] // 2 :].sum() > 10 * hit[:, : SIZE[0] // 2].sum()


def test_a_picture_of_many_tiles_is_the_same_picture(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = renderer.render(SIZE, Camera(), RenderOptions(samples=2))
    monkeypatch.setattr(tiles, "TILE_SIDE", 17)
    np.testing.assert_array_equal(renderer.render(SIZE, Camera(), RenderOptions(samples=2)), whole)


def test_options_do_not_affect_the_next_picture(renderer: Renderer) -> None:
    before = renderer.render(SIZE, Camera())
    options = RenderOptions(1, shade="normal", iterations=(3,), rounds=1, step_scale=0.5, delta_scale=2.0)
    changed = renderer.render(SIZE, Camera(), replace(options, light=(1, 0, 0), background=((1, 0, 0), (0, 1, 0))))
    assert np.abs(before - changed).max() > 0.1
    np.testing.assert_array_equal(renderer.render(SIZE, Camera()), before)


def test_the_first_of_two_background_colors_is_at_the_top(renderer: Renderer) -> None:
    picture = renderer.render(SIZE, Camera(), RenderOptions(background="ff0000,0000ff"))
    assert picture[0, 0, 0] > picture[0, 0, 2]
    assert picture[-1, 0, 2] > picture[-1, 0, 0]


def test_only_a_dark_background_darkens_toward_the_corners(renderer: Renderer) -> None:
    white, gray = (
        renderer.render(SIZE, Camera(), RenderOptions(background=((shade,) * 3, (shade,) * 3))) for shade in (1.0, 0.4)
    )
    around = white[..., 3] == 0
    assert around[0].all()
    np.testing.assert_array_equal(white[around][:, :3], 1.0)
    assert gray[0, 0, 0] < 0.92 * gray[0, SIZE[0] // 2, 0] < 0.37


def test_supersampling_averages_in_linear_light(osmesa: Context) -> None:
    disc = """#version 330
uniform vec2 resolution, origin, jitter;
out vec4 color;
void main() {
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    color = vec4(length(pixel - 0.5 * resolution) < 0.37 * resolution.y ? vec3(1.0, 0.5, 0.0) : vec3(0.2), 1.0);
}"""
    renderer = Renderer(osmesa, Shader(disc, None, (0,), (0,), 0, (1,), (1.0,)))
    options = RenderOptions(rounds=1)
    fine = linear(renderer.render((SIZE[0] * 8, SIZE[1] * 8), Camera(), options))
    boxes = fine.reshape(SIZE[1], 8, SIZE[0], 8, 4).mean(axis=(1, 3))
    ours = linear(renderer.render(SIZE, Camera(), RenderOptions(rounds=1, samples=64)))
    jagged = linear(renderer.render(SIZE, Camera(), options))
    renderer.release()
    assert np.abs(ours - boxes).max() < 0.1
    assert np.abs((ours - boxes).mean(axis=(0, 1))).max() < 3e-4, "as many pixels as the disc covers: no drift"
    assert np.abs(jagged - boxes).max() > 0.2


def test_a_transparent_picture_omits_the_background(renderer: Renderer) -> None:
    red, blue = (
        renderer.render(SIZE, Camera(), RenderOptions(background=(color, color), samples=4, transparent=True))
        for color in ((1, 0, 0), (0, 0, 1))
    )
    np.testing.assert_array_equal(red, blue)
    coverage = red[..., 3]
    assert set(np.unique(coverage)) == {0, 0.25, 0.5, 0.75, 1}
    assert not red[coverage == 0].any()


def test_data_is_never_averaged(renderer: Renderer) -> None:
    np.testing.assert_array_equal(
        renderer.render(SIZE, Camera(), RenderOptions(shade="data", samples=4)), renderer.render(SIZE, Camera(), DATA)
    )


def test_a_tile_is_part_of_the_picture_bottom_row_first(renderer: Renderer) -> None:
    tile = renderer.render_tile((3, 2, 9, 7), SIZE, Camera(), RenderOptions(samples=2))
    whole = renderer.render(SIZE, Camera(), RenderOptions(samples=2))[::-1]
    np.testing.assert_array_equal(tile, whole[2:9, 3:12])


def test_egl_gives_the_same_picture(renderer: Renderer, shader: Shader) -> None:
    context = needs.context("egl")
    other = Renderer(context, shader)
    image = other.render(SIZE, Camera())
    other.release()
    context.release()
    assert np.quantile(np.abs(image - renderer.render(SIZE, Camera())), 0.99) < 1e-3


def test_renderers_share_a_context_and_outlive_one_another(osmesa: Context, renderer: Renderer, shader: Shader) -> None:
    before = renderer.render(SIZE, Camera())
    other, same = Renderer(osmesa, bake(random_model((8, 0)), "texture")), Renderer(osmesa, shader)
    other.render((8, 8), Camera())
    for _ in range(2):
        np.testing.assert_array_equal(renderer.render(SIZE, Camera()), before)
        np.testing.assert_array_equal(same.render(SIZE, Camera()), before)
        other.release()
        other = Renderer(osmesa, shader)
    for resource in (other, same):
        resource.release()


@pytest.mark.parametrize(
    "options",
    [
        {"shade": "toon"},
        {"samples": 0},
        {"samples": 10**6},
        {"iterations": (0,)},
        {"rounds": 0},
        {"step_scale": 0.0},
        {"delta_scale": -1.0},
        {"light": (0, 0, 0)},
        {"light": (1, float("nan"), 0)},
        {"background": ((0, 0, 0), (0, float("nan"), 0))},
        {"background": ((10**400, 0, 0), (0, 0, 0))},
        {"split_at": 10**400},
    ],
)
def test_options_out_of_range_are_errors(options: dict[str, object]) -> None:
    with pytest.raises(UserError):
        RenderOptions(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize("options", [{"level": 3}, {"level": 0}, {"normal_level": 3}, {"iterations": (20, 5, 5)}])
def test_levels_beyond_the_model_are_errors(renderer: Renderer, options: dict[str, object]) -> None:
    with pytest.raises(UserError, match=r"levels|level"):
        renderer.render(SIZE, Camera(), RenderOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [(0, 10), (10, -1), (10, 10**6)])
def test_sizes_out_of_range_are_errors(renderer: Renderer, size: tuple[int, int]) -> None:
    with pytest.raises(UserError, match="each side"):
        renderer.render(size, Camera())


def test_a_rejected_shader_is_one_line_with_its_source(osmesa: Context, shader: Shader) -> None:
    text = shader.text.replace("out vec4 color;", "out vec4 color;\nfloat broken = undefined_name;")
    with pytest.raises(UserError) as raised:
        Renderer(osmesa, replace(shader, text=text))
    assert "\n" not in str(raised.value)
    assert "float broken = undefined_name;" in str(raised.value)
