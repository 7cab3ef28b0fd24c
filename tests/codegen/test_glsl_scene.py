"""A scene in GLSL equals the numpy reference, and its pictures have no holes."""

from pathlib import Path

import numpy as np
import pytest

from mplicits.codegen.targets import glsl330
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.viewer.draw.context import Context
from support.dense_views import compare
from support.glsl_probe import FieldProbe, assert_close, points
from support.scene_models import STILL, composed


def test_glsl_equals_the_reference(osmesa: Context, tmp_path: Path) -> None:
    model = composed(tmp_path, STILL)
    program, probe = lower(model), FieldProbe(osmesa, model, "auto")
    for level in (1, 2):
        gradient, value = interpret.field_gradient(program, points(), level)
        result = probe(level, kind=0)
        assert_close(result[:, 3], value)
        apart = np.linalg.norm(result[:, :3] - gradient, axis=1)
        assert (apart > 1e-4).mean() < 1e-3, "where two shapes are equally far, rounding decides"
    nested, reached = interpret.nested_field(program, points(), 2)
    result = probe(2, kind=1)
    assert (result[:, 1] == reached).mean() > 0.999
    assert_close(result[:, 0], nested)
    colors = np.abs(probe(1, kind=2)[:, :3] - interpret.color(program, points())).max(axis=1)
    assert (colors > 1e-4).mean() < 1e-3


def test_a_scene_refuses_literal_weights(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="keeps its weights in a texture"):
        glsl330.bake(composed(tmp_path), "literal")


def test_expressions_are_printed_with_the_time(tmp_path: Path) -> None:
    text = glsl330.bake(composed(tmp_path)).text
    assert "uniform float time" in text
    assert "(.3 * time)" in text


@pytest.mark.slow
def test_no_view_of_a_scene_has_holes(osmesa: Context, tmp_path: Path) -> None:
    difference = compare(composed(tmp_path, STILL), osmesa, 64)
    assert difference.holes == 0
    assert difference.extra <= 0.002 * difference.outline
    assert difference.apart.size > 5000
