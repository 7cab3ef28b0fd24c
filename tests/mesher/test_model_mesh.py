"""Meshes of trained models are the last level's surface, with its normals and colors."""

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.mesher.extract import extract_model
from mplicits.mesher.grid import Grid
from mplicits.mesher.model_field import ModelField
from mplicits.model.errors import UserError
from mplicits.model.model import Layer, Level, Model
from mplicits.model.model_file import load
from support.fitted_model import fitted_model
from support.nested import same_vertices
from support.paths import DEMO
from support.random_model import random_model


def with_bubble() -> Model:
    """A ball with a second surface inside: the residual, nearly sin(k r) / (k r), is 0 on the ball, 1 in the middle."""
    first = replace(fitted_model().levels[0], delta=0.15, lipschitz=3.0)
    i = np.arange(128)
    z = (2 * i + 1) / 128 - 1
    angle, radius = i * np.pi * (3 - 5**0.5), np.sqrt(1 - z * z)
    directions = np.stack((radius * np.cos(angle), radius * np.sin(angle), z), axis=1)
    hidden = Layer((2 * np.pi / 0.75 * directions).astype(np.float32), np.full(128, np.pi / 2, np.float32))
    last = Layer(np.full((1, 128), 1 / 128, np.float32), np.zeros(1, np.float32))
    return Model("bubble", (first, Level((hidden, last), 0.1, 5, lipschitz=5.0)))


@pytest.mark.parametrize("resolution", [48, 96])
def test_culled_vertices_are_those_of_the_last_level_everywhere(resolution: int) -> None:
    comparison = same_vertices(load(DEMO), resolution)
    assert (comparison.missing, comparison.extra) == (0, 0)
    assert comparison.vertices > 1000


def test_each_vertex_is_on_the_surface_and_has_its_normal_and_color() -> None:
    model = load(DEMO)
    program, mesh = lower(model), extract_model(model, 64).mesh
    gradient, value = interpret.field_gradient(program, mesh.vertices, 2)
    assert np.abs(value).max() < 0.2 * Grid(64).side
    assert mesh.normals is not None
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.normals, gradient / np.linalg.norm(gradient, axis=1)[:, None], atol=1e-3)
    np.testing.assert_allclose(mesh.colors, interpret.color(program, mesh.vertices), atol=1e-6)
    seen = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    facing = np.einsum("ij,ij->i", seen.face_normals, mesh.normals[mesh.faces].sum(axis=1))
    assert (facing > 0).mean() > 0.95


def test_components_outside_the_bands_are_counted_and_left_out() -> None:
    model = with_bubble()
    every, nested = extract_model(model, 64, cull=False), extract_model(model, 64)
    assert every.spurious == 1
    assert np.linalg.norm(every.mesh.vertices, axis=1).min() < 0.3 < np.linalg.norm(nested.mesh.vertices, axis=1).min()
    assert every.mesh.components()[0] == every.components
    assert nested.mesh.components()[0] == nested.components == every.components - every.spurious
    assert trimesh.Trimesh(nested.mesh.vertices, nested.mesh.faces, process=False).is_watertight
    comparison = same_vertices(model, 64)
    assert (comparison.missing, comparison.extra, comparison.spurious) == (0, 0, every.spurious)


def test_a_band_decides_which_level_is_evaluated() -> None:
    model = fitted_model()
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (2000, 3)).astype(np.float32)
    program, cell = lower(model), 0.01
    first, last = (interpret.field(program, points, level) for level in (1, 2))
    wide = np.abs(first) < model.levels[0].delta + model.levels[0].lipschitz * cell
    assert 500 < wide.sum() < 1500
    np.testing.assert_allclose(ModelField(model, cell).value(points), np.where(wide, last, first), atol=1e-6)
    np.testing.assert_allclose(ModelField(model, math.inf).value(points), last, atol=1e-6)


def test_the_clearance_is_no_more_than_the_distance_to_the_surface() -> None:
    model = load(DEMO)
    surface = extract_model(model, 96).mesh.vertices
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    clearance = ModelField(model, Grid(96).diagonal).clearance(points)
    nearest = cKDTree(surface).query(points)[0]
    assert (clearance <= nearest).all()
    assert np.median(clearance / nearest) > 0.3


def test_a_moving_model_is_evaluated_at_its_time() -> None:
    model = random_model((8, 1), (8, 1), inputs="xyzt")
    points = np.random.default_rng(0).uniform(-1, 1, (100, 3)).astype(np.float32)
    for time in (0.0, 0.4):
        expected = interpret.field(lower(model), points, 2, time)
        np.testing.assert_allclose(ModelField(model, math.inf, time).value(points), expected, atol=1e-6)


def test_a_model_without_a_surface_is_refused() -> None:
    model = fitted_model()
    hidden, last = model.levels[0].network
    far = replace(model.levels[0], network=(hidden, replace(last, bias=last.bias + 100)))
    with pytest.raises(UserError, match="no surface"):
        extract_model(replace(model, levels=(far,)), 16)
