"""A trained model, written as a mesh, comes back the same: place, size, orientation and colors, in every format."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mplicits.field import interpret
from mplicits.field.interpret import field_gradient
from mplicits.ir.lower import lower
from mplicits.mesher.options import MeshOptions
from mplicits.mesher.triangle_mesh import make_mesh
from mplicits.model.model import Model
from mplicits.model.orientation import DEFAULT_UP
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape, unit
from support.ball_training import train

RADII = np.array((1.0, 0.7, 0.5))
PLACES = {"near": (0.0, 0.0, 0.0), "far": (500_000.0, 120.0, -4_649_776.0)}
"""Centers, upright."""
SETTINGS = Settings(networks=((16, 1), (16, 1)), omegas=(8.0, 16.0, 16.0), steps=(250, 150, 300), up="z")


def colored_cloud() -> Shape:
    """An ellipsoid of colored points, z up."""
    directions = unit(np.random.default_rng(0).normal(size=(4000, 3)))
    shape, _ = load_shape((directions * RADII, directions / RADII, 0.5 + 0.35 * directions), up="z", noise=0.0)
    return shape


@pytest.fixture(scope="module")
def first() -> Model:
    return train(colored_cloud(), SETTINGS)


@pytest.fixture(params=PLACES)
def trained(request: pytest.FixtureRequest, first: Model) -> Model:
    return replace(first, center=PLACES[request.param])


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb"])
@pytest.mark.filterwarnings("ignore:(STL|GLB) stores coordinates")
def test_a_mesh_comes_back_as_the_model(trained: Model, suffix: str, tmp_path: Path) -> None:
    make_mesh(trained, MeshOptions(resolution=48, quiet=True)).save(tmp_path / f"m{suffix}")
    shape, warnings = load_shape(str(tmp_path / f"m{suffix}"), up=trained.up or DEFAULT_UP, crease=None)
    rounded = abs(trained.center[0]) > 1000 and suffix in {".stl", ".glb"}  # float32, which the verb warns of
    coarse = 0.6 if rounded else 0.03
    assert rounded or warnings == []
    np.testing.assert_allclose(shape.center, trained.center, atol=coarse)
    assert shape.scale == pytest.approx(trained.scale, rel=coarse)
    if rounded:
        return
    program = lower(trained)
    drawn = shape.surface(2000, np.random.default_rng(1), colors=True)
    there = ((drawn.points * shape.scale + shape.center) - trained.center) / trained.scale
    gradient, value = field_gradient(program, there.astype(np.float32), len(trained.levels))
    assert np.abs(value).max() < 0.02
    assert (unit(gradient.astype(np.float64)) * drawn.normals).sum(axis=1).min() > 0.8
    assert shape.colored == (suffix != ".stl")
    if drawn.colors is not None:
        colors = np.clip(interpret.color(program, there.astype(np.float32)), 0, 1)
        assert np.quantile(np.abs(drawn.colors - colors), 0.97) < 0.03
