"""Shadertoy texts compute the numpy reference's field, and draw the renderer's picture."""

import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.motion import PERIOD
from mplicits.codegen.targets.shadertoy_text import savings
from mplicits.field import digits, interpret
from mplicits.field.surface_points import near_surface
from mplicits.ir.lower import lower
from mplicits.model import quantize
from mplicits.model.errors import UserError
from mplicits.model.model import Layer
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.renderer import Renderer
from oracles.march import half_widths, margins
from support.compilers import ES, check_glsl
from support.golden_text import check_golden
from support.moving_model import moving_model
from support.paths import GOLDEN
from support.random_model import random_model
from support.scene_models import SCENE, composed
from support.shadertoy import INPUTS, MAIN, PROBE, SHADERTOY, SIZE, demo, draw, literal_text, picture

DIGITS = {"packed": None, "literal": 7}
GOLDEN_TEXT = GOLDEN / "tiny.shadertoy.frag"


@pytest.fixture(scope="module")
def small() -> str:
    """The text of a small model with a credit and a front."""
    model = random_model((16, 1), (8, 0), texture=(8, 0), name="small")
    return SHADERTOY(replace(quantize.quantized_model(model), front=(200.0, 10.0), credit="someone, CC0"), "packed")


@pytest.mark.parametrize("storage", ["packed", "literal"])
def test_the_field_equals_the_reference(osmesa: Context, storage: str) -> None:
    model = quantize.quantized_model(random_model((16, 1), (18, 2), (8, 0)))
    points = np.random.default_rng(2).uniform(-1, 1, (64 * 64, 3)).astype(np.float32)
    text = INPUTS + SHADERTOY(model, storage, DIGITS[storage])
    field = draw(osmesa, text + PROBE, (64, 64), {}, points)[::-1, :, 0].ravel()
    program = lower(model)
    narrow = savings(program, len(text)).narrow
    widths = half_widths(program, () if narrow is None else (narrow,), points)
    nested, reached = interpret.nested_field(program, points, 3, margins=margins(program, widths))
    offsets = np.choose(reached - 1, [*widths[:2], np.zeros(len(points))])
    expected = nested - offsets / 1.3
    away = np.abs(np.abs(nested) - offsets) > 2e-3  # of a band's edge, which the text gives to 3 digits
    np.testing.assert_allclose(field[away], expected[away], rtol=0, atol=3e-3)
    exact = away & (reached == 3)
    assert exact.sum() > 300
    np.testing.assert_allclose(field[exact], expected[exact], rtol=0, atol=2e-5 * np.abs(expected).max())


@pytest.mark.parametrize("level", [1, 2])
def test_a_scene_equals_the_reference(osmesa: Context, tmp_path: Path, level: int) -> None:
    model = composed(tmp_path, SCENE, widths=(8, 12))
    program, points = lower(model), np.random.default_rng(2).uniform(-0.7, 0.7, (64 * 64, 3)).astype(np.float32)
    text = INPUTS + SHADERTOY(model, "literal", digits=7).replace("#define LEVEL 2", f"#define LEVEL {level}")
    field = draw(osmesa, text + PROBE, (64, 64), {}, points)[::-1, :, 0].ravel()
    nested, reached = interpret.nested_field(program, points, level, 1.0)
    expected = nested - (reached < level) * model.levels[0].delta / 1.3
    away = np.abs(np.abs(nested) - model.levels[0].delta) > 1e-4
    assert (np.abs(field - expected)[away] > 2e-5).mean() < 1e-3
    assert (reached == level).sum() > 100
    albedo = PROBE.replace("(field(", "(albedo(").replace("1)));", "1)), 1);")
    colors = draw(osmesa, text + albedo, (64, 64), {}, points)
    apart = np.abs(colors[::-1, :, :3].reshape(-1, 3) - interpret.color(program, points, 1.0)).max(axis=1)
    assert (apart > 1e-3).mean() < 2e-3, "where two shapes are equally far, rounding decides"


def test_a_model_of_many_layers_is_packed(osmesa: Context) -> None:
    """Many layers of the same shape, with different steps."""
    model = quantize.quantized_model(random_model((4, 8), (4, 9)))
    points = np.random.default_rng(2).uniform(-1, 1, (64 * 64, 3)).astype(np.float32)
    field = draw(osmesa, INPUTS + SHADERTOY(model, "packed") + PROBE, (64, 64), {}, points)[::-1, :, 0].ravel()
    nested, reached = interpret.nested_field(lower(model), points, 2)
    np.testing.assert_allclose(field[reached == 2], nested[reached == 2], rtol=0, atol=1e-3)
    assert SHADERTOY.size(model) == len(SHADERTOY(model, "packed").encode())


def test_a_model_without_a_surface_is_written_without_a_warning() -> None:
    model = random_model((4, 0))
    level = model.levels[0]
    *hidden, last = level.network
    away = replace(level, network=(*hidden, Layer(last.weight, last.bias + 50)))
    with warnings.catch_warnings(action="error"):
        assert SHADERTOY(replace(model, levels=(away,)))


def test_a_quantized_model_is_not_quantized_again() -> None:
    model = random_model((16, 1), (18, 2), texture=(10, 1))
    assert not quantize.is_quantized(model.levels[0].network)
    once = quantize.quantized_model(model)
    assert all(quantize.is_quantized(level.network) for level in once.levels)
    for before, after in zip(once.levels, quantize.quantized_model(once).levels, strict=True):
        assert before.network is after.network
    for old, new in zip(model.levels[1].network, once.levels[1].network, strict=True):
        assert float(np.abs(old.weight - new.weight).mean()) < 0.1 * float(np.abs(old.weight).mean())


def test_a_rounded_step_still_represents_the_largest_weight() -> None:
    first, last = random_model((20, 0)).levels[0].network
    weight = first.weight * np.float32(127 * 0.010049 / np.abs(first.weight).max())
    assert quantize.is_quantized(quantize.quantized((Layer(weight, first.bias), last)))


def test_the_text_draws_the_renderer_s_picture(osmesa: Context) -> None:
    """In spite of normals by differences, a gamma of 2.2 and a plain background."""
    model = demo()
    text = re.sub("#define (BOTTOM|TOP) .*", r"#define \1 vec3(0)", literal_text(model, "phong"))
    ours = picture(osmesa, text)
    theirs = Renderer(osmesa, bake(model, "texture")).render(SIZE, Camera())
    inside, expected = ours.max(-1) > 0, theirs[..., 3] > 0
    assert (inside & expected).sum() / (inside | expected).sum() > 0.985, (
        "the text counts grazing rays as hits farther out"
    )
    both = inside & expected
    difference = np.abs(ours - 255 * theirs[..., :3])[both]
    assert np.median(difference) < 4
    assert np.percentile(difference, 90) < 24  # at edges and stripes a pixel's center decides


def test_a_drag_adds_to_the_turntable(osmesa: Context, small: str) -> None:
    released = picture(osmesa, small)
    down, up = (picture(osmesa, small, (100, 40, 60 * sign, 50 * sign)) for sign in (1, -1))
    assert np.abs(released - down).mean() > 2
    np.testing.assert_array_equal(down, up)
    assert np.abs(up - picture(osmesa, small, (100, 40, -60, -50), time=2)).mean() > 2
    np.testing.assert_array_equal(released, picture(osmesa, small, (100, 40, 100, 40)))  # no jump at the button's press
    turned = re.sub(r"#define VIEW .*", f"#define VIEW vec2({200 + np.degrees(0.6):.4f}, 10.)", small)
    assert np.abs(picture(osmesa, small, time=2) - picture(osmesa, turned)).mean() < 1


def test_the_camera_stops_before_the_poles(osmesa: Context, small: str) -> None:
    below = re.sub(r"#define VIEW .*", f"#define VIEW vec2(200., {np.degrees(-1.4):.4f})", small)
    far, farther = (picture(osmesa, small, (0, y, 0, 0)) for y in (90, 1000))
    np.testing.assert_array_equal(far, farther)
    assert np.abs(far - picture(osmesa, below)).mean() < 0.1


def test_the_shape_fits_the_smaller_side(osmesa: Context, small: str) -> None:
    """The middle of a strip is the square picture, except for the background."""
    flat = re.sub("#define (BOTTOM|TOP) .*", r"#define \1 vec3(0)", small)
    square = picture(osmesa, flat, size=(48, 48))
    assert (square.max(-1) > 0).mean() > 0.05
    for size in ((384, 48), (48, 384)):
        strip = picture(osmesa, flat, size=size)
        middle = strip[:, 168:216] if size[0] > size[1] else strip[168:216]
        assert (np.abs(middle - square).max(-1) > 8).mean() < 0.01
        assert ((strip.max(-1) > 0).sum() - (square.max(-1) > 0).sum()) < 0.02 * square[..., 0].size


def test_four_samples_soften_only_edges(osmesa: Context, small: str) -> None:
    one, four = (picture(osmesa, small.replace("#define AA 1", f"#define AA {n}")) for n in (1, 2))
    changed = np.abs(one - four).max(-1) > 8
    assert 0.002 < changed.mean() < 0.2
    assert len(np.unique(four.reshape(-1, 3), axis=0)) > len(np.unique(one.reshape(-1, 3), axis=0))


def test_the_level_is_a_setting(osmesa: Context) -> None:
    model = quantize.quantized_model(random_model((16, 1), (18, 2)))
    points = np.random.default_rng(2).uniform(-1, 1, (32 * 32, 3)).astype(np.float32)
    text = SHADERTOY(model, "packed").replace("#define LEVEL 2", "#define LEVEL 1")
    field = draw(osmesa, INPUTS + text + PROBE, (32, 32), {}, points)[::-1, :, 0].ravel()
    np.testing.assert_allclose(field, interpret.field(lower(model), points, 1), atol=2e-5)


def test_the_head_describes_the_model_and_escapes_any_text(tmp_path: Path) -> None:
    model = random_model((8, 0), name='a "name" */\n#error\\')
    text = SHADERTOY(replace(model, credit="A\n#error\u2028 B, CC BY 4.0 \\", front=(-30.0, 5.0)), "packed")
    head = text[: text.index("#define VIEW")].splitlines()
    assert all(line.startswith("// ") and not line.endswith("\\") for line in head)
    assert text.isascii()
    assert "CC BY 4.0" in head[1]
    assert "#define VIEW vec2(-30., 5.)" in text
    assert "mplicits" in head[2]
    for setting in ("SPEED", "LIGHT", "COLOR", "BOTTOM", "TOP", "STEPS", "AA"):
        assert re.search(rf"(?m)^#define {setting} .*//", text) or setting == "TOP"
    check_glsl(ES + INPUTS + text + MAIN, tmp_path)


def test_a_motion_runs_there_and_back(osmesa: Context) -> None:
    """Without the turntable, both halves of the period show the same pictures."""
    text = re.sub("#define SPEED .*", "#define SPEED 0.", SHADERTOY(moving_model(), "literal"))
    there, end, back, again = (picture(osmesa, text, time=share * PERIOD) for share in (0.2, 0.5, 0.8, 1.2))
    for same in (back, again):
        assert (np.abs(there - same).max(-1) > 2).mean() < 0.01
    assert (np.abs(there - end).max(-1) > 30).mean() > 0.05


def test_digits_are_the_fewest_that_keep_the_surface() -> None:
    model = demo()
    exact = lower(model)
    points = near_surface(exact)
    assert np.abs(interpret.field(exact, points, 2)).mean() < 1e-3
    fewest = digits.fewest_digits(model)
    errors = [digits.error(exact, lower(model, count), points) for count in (fewest - 1, fewest)]
    assert errors[1] < digits.SHARE * model.levels[-1].delta < errors[0]
    assert literal_text(model, "phong") == SHADERTOY(model, "literal", digits=fewest, shade="phong")


def test_the_text_equals_the_golden_file(request: pytest.FixtureRequest) -> None:
    text = SHADERTOY(
        quantize.quantized_model(random_model((4, 1), (8, 0), texture=(4, 0), name='tiny "/*\n</script>\\')), "packed"
    )
    check_golden(text, GOLDEN_TEXT, request)


def long_text(storage: str) -> str:
    """Return a literal text with a hull and narrow bands, or the packed text of a wide model."""
    if storage == "literal":
        return literal_text(demo(), "phong")
    model = random_model((64, 1), (64, 2), texture=(8, 1), name="a\nb\\")
    return SHADERTOY(quantize.quantized_model(model), "packed", shade="phong")


@pytest.mark.parametrize("storage", ["packed", "literal"])
def test_the_text_respects_the_limits_of_shadertoy_and_browsers(tmp_path: Path, storage: str) -> None:
    text = long_text(storage)
    assert text.isascii()
    assert len(re.findall(r"\bfield ?\(", text)) == 2, "one definition, one call"
    assert "min(iFrame" in text
    assert max(statement.count("+") for statement in re.split(r";|,\n", text)) < 200
    check_glsl(ES + INPUTS + text + MAIN, tmp_path)


def test_a_moving_text_reads_the_time_and_is_not_packed() -> None:
    text = SHADERTOY(random_model((8, 1), inputs="xyzt"))
    assert "TIME));" in text
    assert "M(" not in text


def test_wide_models_and_textures_as_storage_are_refused() -> None:
    with pytest.raises(UserError, match=r"68 wide.*--preset small"):
        SHADERTOY(random_model((68, 1)))
    with pytest.raises(UserError, match="--storage texture"):
        SHADERTOY(random_model((8, 1)), "texture")
