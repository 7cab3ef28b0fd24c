"""The WebGL2 target: golden text, glslang, precise sines; and models with rounded weights, as pages have them."""

from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits import glsl
from mplicits.bake.registry import TARGETS
from mplicits.cli import main
from mplicits.codegen.targets import glsl300es
from mplicits.codegen.targets.glsl330 import read_weights
from mplicits.field import interpret
from mplicits.field.rounding import in_decimals, in_float16, is_float16, rounding_error
from mplicits.field.surface_points import near_surface
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from support.compilers import check_glsl
from support.fitted_model import fitted_model
from support.golden_text import check_golden
from support.paths import GOLDEN
from support.random_model import random_model

GOLDEN_TEXT = GOLDEN / "tiny.glsl300es.frag"
SINES = (
    """#version 330
uniform sampler2D angles;
out vec4 color;
"""
    + glsl.load("sine.glsl")
    + """
void main() {
    vec4 x = texelFetch(angles, ivec2(gl_FragCoord.xy), 0);
    color = vec4(sine(x).xy, cosine(x).zw);
}
"""
)


def test_the_text_equals_the_golden_file(request: pytest.FixtureRequest) -> None:
    model = random_model((4, 1), (8, 0), texture=(4, 0), name='tiny "/*\n</script>\\')
    text = TARGETS["glsl300es"](model, digits=3)
    check_golden(text, GOLDEN_TEXT, request)


@pytest.mark.parametrize("inputs", ["xyz", "xyzt"])
@pytest.mark.parametrize("storage", ["literal", "texture", "auto"])
def test_glslang_compiles_every_storage(tmp_path: Path, storage: str, inputs: str) -> None:
    model = random_model((8, 1), (68, 1), texture=(4, 0), name="a\nb\\", inputs=inputs)
    check_glsl(TARGETS["glsl300es"](model, storage=storage), tmp_path)


def test_the_weight_texture_is_read_back_from_the_file() -> None:
    model = random_model((8, 1))
    read_back = read_weights(TARGETS["glsl300es"](model, storage="texture"))
    weights = glsl300es.bake(model, "texture").weights
    assert read_back is not None
    assert weights is not None
    np.testing.assert_array_equal(read_back, weights)


def test_sines_are_off_by_less_than_6e_7(osmesa: Context) -> None:
    rng = np.random.default_rng(0)
    angles = np.concatenate([np.linspace(-4, 4, 64 * 64 * 2), rng.uniform(-1e4, 1e4, 64 * 64 * 2)]).astype(np.float32)
    rng.shuffle(angles)
    angles = angles.reshape(-1, 4)
    with osmesa as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=SINES)
        texture = gl.texture((64, 64), 4, angles.tobytes(), dtype="f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.use(0)
        target = gl.framebuffer([gl.texture((64, 64), 4, dtype="f4")])
        target.use()
        gl.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
        sines = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(-1, 4)
    exact = angles.astype(np.float64)
    expected = np.concatenate([np.sin(exact[:, :2]), np.cos(exact[:, 2:])], axis=1)
    assert np.abs(sines - expected).max() < 6e-7


def field_of(model: Model, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Evaluate a model's last level at points (N, 3) by the numpy reference; returns (N,)."""
    return interpret.field(lower(model), points, len(model.levels))


def test_in_decimals_rounds_like_lower() -> None:
    model = random_model((8, 1), (12, 0), texture=(4, 0))
    rounded = in_decimals(model, 2)
    points = np.random.default_rng(1).uniform(-1, 1, (500, 3)).astype(np.float32)
    printed = interpret.field(lower(model, 2), points, 2)
    np.testing.assert_allclose(field_of(rounded, points), printed, rtol=0, atol=2e-6)
    assert np.abs(field_of(rounded, points) - field_of(model, points)).max() > 1e-3


def test_in_float16_rounds_all_weights_and_refuses_large_ones() -> None:
    model = fitted_model((16, 24))
    half = in_float16(model)
    assert is_float16(half)
    assert not is_float16(model)
    assert sorted(half.tensors()) == sorted(model.tensors())
    points = near_surface(lower(model))
    difference = np.abs(field_of(half, points) - field_of(model, points))
    assert rounding_error(model, half) == pytest.approx((difference.max(), difference.mean()))
    assert difference.max() > 0
    layer = model.levels[0].network[0]
    layer.weight[0, 0] = 1e5
    with pytest.raises(UserError, match=r"level1\.layer0\.weight"):
        in_float16(model)


def test_bake_names_its_file_and_prints_the_error_of_float16(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len({target.suffix for target in TARGETS.values()}) == len(TARGETS)
    monkeypatch.chdir(tmp_path)
    save(fitted_model((8, 8)), Path("ball.safetensors"))
    sizes = {}
    for precision in ("float32", "float16"):
        argv = ["bake", "ball.safetensors", "--target", "html", "--storage", "texture", "--precision", precision]
        assert main(argv) == 0
        sizes[precision] = Path("ball.html").stat().st_size
    assert sizes["float16"] <= sizes["float32"]
    err = capsys.readouterr().err.splitlines()
    assert any(line.startswith("ball.html: html, ") for line in err)
    assert any(line.startswith("float16: the distance near the surface is off by ") for line in err)
    assert main(["bake", "ball.safetensors", "--target", "glsl300es"]) == 0
    assert Path("ball.es.frag").read_text().startswith("#version 300 es\n")
    assert main(["bake", "ball.safetensors", "--digits", "3", "--precision", "float16"]) == 2
