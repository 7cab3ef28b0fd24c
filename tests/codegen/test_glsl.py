"""A GLSL shader computes the numpy reference's field, in a float framebuffer on OSMesa."""

from pathlib import Path

import numpy as np
import pytest

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import glsl330
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from oracles.march import half_widths, margins
from support.compilers import check_glsl
from support.glsl_probe import FieldProbe, assert_close, points
from support.golden_text import check_golden
from support.paths import GOLDEN
from support.random_model import random_model

GOLDEN_TEXT = GOLDEN / "tiny.glsl330.frag"


@pytest.mark.parametrize("storage", ["literal", "texture"])
def test_glsl_equals_the_reference(osmesa: Context, storage: str) -> None:
    model = random_model((16, 1), (18, 2), (64, 1), texture=(10, 1))
    program, probe = lower(model), FieldProbe(osmesa, model, storage)
    assert len(probe.narrow) == (2 if storage == "literal" else 0), "narrow bands need a long text"
    for level in (1, 3):
        gradient, value = interpret.field_gradient(program, points(), level)
        result = probe(level, kind=0)
        assert_close(result[:, :3], gradient)
        assert_close(result[:, 3], value)
    widths = half_widths(program, probe.narrow, points())
    nested, reached = interpret.nested_field(program, points(), 3, margins=margins(program, widths))
    result = probe(3, kind=1)
    np.testing.assert_array_equal(result[:, 1], reached)
    assert_close(result[:, 0], nested)
    assert_close(probe(1, kind=2)[:, :3], interpret.color(program, points()))


@pytest.mark.slow
def test_auto_storage_puts_wide_networks_in_the_texture(osmesa: Context) -> None:
    model = random_model((16, 1), (68, 1))
    shader = glsl330.bake(model)
    assert shader.weights is not None
    assert "const mat4 w1_1_0_0" in shader.text
    assert "const mat4 w2" not in shader.text
    assert shader.value_loops[0] == 0 < shader.value_loops[1]
    gradient, value = interpret.field_gradient(lower(model), points(), 2)
    result = FieldProbe(osmesa, model, "auto")(2, kind=0)
    assert_close(result[:, :3], gradient)
    assert_close(result[:, 3], value)


def test_the_text_equals_the_golden_file(request: pytest.FixtureRequest) -> None:
    text = TARGETS["glsl330"](random_model((4, 1), (8, 0), texture=(4, 0), name='tiny "/*\n</script>\\'), digits=3)
    check_golden(text, GOLDEN_TEXT, request)


@pytest.mark.parametrize("storage", ["literal", "texture"])
def test_the_file_compiles(osmesa: Context, tmp_path: Path, storage: str) -> None:
    text = TARGETS["glsl330"](random_model((8, 1), (12, 1), texture=(4, 0), name="a\nb\\"), storage=storage)
    with osmesa as gl:
        gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=text)
    check_glsl(text, tmp_path)


@pytest.mark.parametrize("name", ['"/* */ </script> ??/ é\u2028\x00\nvoid main() {}', "back\\"])
def test_a_model_name_stays_in_its_comment(name: str) -> None:
    with_name, plain = (TARGETS["glsl330"](random_model((4, 0), name=title)) for title in (name, "plain"))
    difference = [line for line in with_name.split("\n") if line not in plain.split("\n")]
    assert len(difference) == 1
    assert difference[0].startswith("// ")
    assert difference[0].isascii()
    assert difference[0].isprintable()
    assert not difference[0].endswith("\\")
