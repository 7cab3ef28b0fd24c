"""The line about a model's surface that a training ends with, and the loose pieces that it looks for."""

import numpy as np
import pytest
import trimesh

from mplicits.mesher import surface_line
from mplicits.mesher.model_field import ModelField
from mplicits.mesher.surface import Mesh
from mplicits.mesher.surface_line import describe_surface
from mplicits.model.model import Layer, Level, Model


def slabs(omega: float, offset: float) -> Model:
    """One level, f(x, y, z) = (sin(omega x) + offset) / omega: slabs between planes across x."""
    first = Layer(np.array([[omega, 0, 0]], np.float32), np.zeros(1, np.float32))
    last = Layer(np.array([[1 / omega]], np.float32), np.array([offset / omega], np.float32))
    return Model("slabs", (Level((first, last), 0.05, 20),))


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Survey on a coarse grid, which is enough for slabs."""
    monkeypatch.setattr("mplicits.mesher.surface_line.RESOLUTION", 32)


@pytest.mark.parametrize(("omega", "count"), [(3.0, "1 closed component ("), (8.0, "3 closed components (")])
def test_components_are_counted(omega: float, count: str) -> None:
    assert describe_surface(slabs(omega, 0.0), quiet=True).startswith(f"surface: {count}")


def test_a_model_without_a_surface_is_described_too() -> None:
    assert describe_surface(slabs(4.0, 2.0), quiet=True).startswith("surface: the model has no surface")


def test_small_components_beside_the_largest_are_loose(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball with a hollow, a fleck, and a second part that is as likely to be the shape's own."""
    sphere = trimesh.creation.icosphere(3)
    balls = [((0.7, 0, 0), 0.01), ((0, 0, 0), 0.5), ((0, 0.7, 0), 0.1), ((0.1, 0, 0), 0.02)]
    vertices = np.concatenate([radius * sphere.vertices + center for center, radius in balls]).astype(np.float32)
    faces = np.concatenate([sphere.faces + i * len(sphere.vertices) for i in range(4)])
    mesh = Mesh(vertices, faces.astype(np.int64))
    model, fleck, hollow = slabs(4.0, 0.0), vertices[: len(sphere.vertices)], vertices[-len(sphere.vertices) :]
    monkeypatch.setattr(surface_line, "extract", lambda *_: mesh)
    np.testing.assert_array_equal(surface_line.loose_components(model), np.concatenate((fleck, hollow)))
    monkeypatch.setattr(ModelField, "in_bands", lambda self, points: points[:, 0] < 0.5)
    np.testing.assert_array_equal(surface_line.loose_components(model), hollow)
    nothing = Mesh(mesh.vertices[:0], mesh.faces[:0])
    monkeypatch.setattr(surface_line, "extract", lambda *_: nothing)
    assert not len(surface_line.loose_components(model))
