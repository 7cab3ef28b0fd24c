"""NAME_trace of the function targets finds the intersections of `Field.trace`, in every language and space."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mplicits
from mplicits.bake.registry import TARGETS
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.orientation import as_in_file
from mplicits.viewer.draw.context import Context
from support.fitted_model import fitted_model
from support.function_runners import COUNT, TIME, Array, in_c, in_glsl, in_hlsl, in_wgsl
from support.moving_model import moving_model
from support.random_model import random_model
from support.scene_models import SCENE, composed

SHADER = (
    "VEC3 o = VEC3(CENTER), d = .6 * (p.yzx - o.yzx) - (p - o); float t;"
    "bool hit = model_trace(p, dTIME, t, n); a = FOUR(hit ? 1. : 0., t, n.x, n.y); b = FOUR(n.z, 0., 0., 0.);"
)
WGSL = (
    "let o = vec3f(CENTER); let d = .6 * (p.yzx - o.yzx) - (p - o); var t: f32;"
    "let hit = model_trace(p, dTIME, &t, &n); a = vec4f(select(0., 1., hit), t, n.x, n.y); b = vec4f(n.z, 0., 0., 0.);"
)
C = (
    "const float c[3] = {CENTER}; float d[3], n[3], t;"
    "for (int k = 0; k < 3; k++) d[k] = .6f * (p[(k + 1) % 3] - c[(k + 1) % 3]) - (p[k] - c[k]);"
    "r[0] = model_trace(p, dTIME, &t, n); r[1] = t; r[5] = r[6] = r[7] = 0.f;"
    "for (int k = 0; k < 3; k++) r[2 + k] = n[k];"
)
RUNNERS: dict[str, tuple[Callable[..., Array], str]] = {
    "glsl": (in_glsl, SHADER.replace("VEC3", "vec3")),
    "hlsl": (in_hlsl, SHADER.replace("VEC3", "float3")),
    "wgsl": (in_wgsl, WGSL),
    "c": (in_c, C),
}
"""Target -> how to run it, and statements that trace from p along .6 q.yzx - q, q = p - CENTER."""


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Model, str]]:
    """Return models, and the space of their rays."""
    return {
        "placed": (replace(fitted_model((24, 48)), center=(0.5, -2.0, 1.0), scale=3.0, up="z"), "input"),
        "moving": (moving_model((16, 24)), "model"),
        "scene": (composed(tmp_path_factory.mktemp("scene"), SCENE, widths=(8, 12)), "input"),
    }


def test_every_marching_target_has_a_runner() -> None:
    assert set(RUNNERS) == {name for name, target in TARGETS.items() if target.march}


@pytest.mark.parametrize("case", ["placed", "moving", "scene"])
@pytest.mark.parametrize("target", RUNNERS)
def test_rays_end_where_the_reference_s_do(
    target: str, case: str, models: dict[str, tuple[Model, str]], osmesa: Context, tmp_path: Path
) -> None:
    model, space = models[case]
    field, scale = mplicits.Field(model), model.scale if space == "input" else 1.0
    center = as_in_file(np.array(model.center), model.up) if space == "input" else np.zeros(3)
    local = np.random.default_rng(1).uniform(-1.5, 1.5, (COUNT, 3))
    points = (local * scale + center).astype(np.float32)
    q = points - center
    directions = 0.6 * q[:, [1, 2, 0]] - q
    time = TIME if model.inputs == "xyzt" else 0.0
    hits = field.trace(points, directions, space=space, time=time)
    run, statements = RUNNERS[target]
    statements = statements.replace("CENTER", ", ".join(map(str, center)))
    statements = statements.replace("TIME", ", time" if model.inputs == "xyzt" else "")
    text = TARGETS[target](model, name="model", space=space, with_march=True)
    hit, t, *normal = run(text, statements, points, tmp_path, osmesa).T[:5]
    assert 0.25 < hits.hit.mean() < 0.9
    assert ((hit > 0) != hits.hit).mean() < 1e-3
    assert not t[hit == 0].any()
    # Where parts of this scene meet, its field may jump from above to below 0.
    still = np.abs(field.sdf(np.nan_to_num(hits.points), space=space, time=time)) < 1e-3 * scale
    both = (hit > 0) & hits.hit & (still | (hits.t == 0))
    assert both.sum() > 0.8 * hits.hit.sum()
    apart = np.abs(t * np.linalg.norm(directions, axis=1) - hits.t)[both] / scale
    assert np.quantile(apart, 0.99) < 1e-5
    turned = np.abs(np.stack(normal, axis=1) - hits.normals)[both].max(axis=1)
    assert np.quantile(turned, 0.99) < 1e-3


def test_other_targets_refuse_to_march() -> None:
    for target in TARGETS.keys() - RUNNERS.keys():
        with pytest.raises(UserError, match=r"--with-march: only these targets take it: glsl, wgsl, hlsl, c$"):
            TARGETS[target](random_model((4, 0)), with_march=True)
