"""Files written in many ways are read as what was written."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mplicits.model.srgb import to_srgb
from mplicits.readers.content import Cloud, Mesh
from mplicits.readers.read import read_shape
from support.written_glb import glbs
from support.written_shapes import COLORS, CORNERS, Doubles, normals_of, objs, plys, texts

MANY = settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
POINTS = np.random.default_rng(1).normal(size=(40, 3)) * (3, 2, 1) + (10, 0, 0)
TINTS = np.random.default_rng(2).uniform(0.02, 1, (40, 3))
VOLUME = 6.0


def read(name: str, data: bytes) -> Mesh | Cloud:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        return read_shape(path)


def assert_solid(mesh: Mesh, corners: Doubles, colors: Doubles | None, volume: float = VOLUME) -> None:
    """The mesh has these corners, encloses this volume, and its corners have these colors, sRGB."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert np.einsum("ij,ij->i", a - a[0], np.cross(b - a[0], c - a[0])).sum() / 6 == pytest.approx(volume, rel=1e-4)
    distance = np.linalg.norm(mesh.vertices[mesh.faces][:, :, None] - corners, axis=3)
    assert distance.min(axis=2).max() < 1e-4 * np.abs(corners).max()
    assert (mesh.paint is None) == (colors is None)
    if mesh.paint is not None and colors is not None:
        for k in range(3):
            at = np.tile(np.eye(3)[k][None, :, None], (len(mesh.faces), 1, 1))
            found = mesh.paint.at(np.arange(len(mesh.faces)), at)
            np.testing.assert_allclose(found, colors[distance[:, k].argmin(axis=1)], atol=3e-3)


@MANY
@given(plys())
def test_plys(written: tuple[bytes, bool, bool]) -> None:
    data, with_faces, colored = written
    content = read("a.ply", data)
    if with_faces:
        assert isinstance(content, Mesh)
        assert_solid(content, CORNERS, COLORS if colored else None)
        return
    assert isinstance(content, Cloud)
    np.testing.assert_allclose(content.points, CORNERS)
    assert content.normals is not None
    np.testing.assert_allclose(content.normals, normals_of(CORNERS), atol=1e-6)
    assert (content.colors is not None) == colored
    if content.colors is not None:
        np.testing.assert_allclose(content.colors, COLORS, atol=1e-5)


@MANY
@given(objs())
def test_objs(written: tuple[bytes, bool]) -> None:
    data, colored = written
    content = read("a.obj", data)
    assert isinstance(content, Mesh)
    assert_solid(content, CORNERS, COLORS if colored else None)


@MANY
@given(texts(POINTS, TINTS), st.sampled_from(["a.xyz", "a.csv", "a.txt", "a.asc", "a.pts"]))
def test_texts(written: tuple[bytes, bool, bool], name: str) -> None:
    data, with_normals, colored = written
    content = read(name, data)
    assert isinstance(content, Cloud)
    np.testing.assert_allclose(content.points, POINTS, rtol=1e-7)
    assert (content.normals is not None, content.colors is not None) == (with_normals, colored)
    if content.normals is not None:
        np.testing.assert_allclose(content.normals, normals_of(POINTS), atol=1e-6)
    if content.colors is not None:
        np.testing.assert_allclose(content.colors, TINTS, atol=3e-3)
    assert (b"gps_time" in data) == any("gps_time" in line for line in content.facts.warnings)


@MANY
@given(glbs())
def test_glbs(written: tuple[bytes, Doubles, Doubles | None]) -> None:
    data, corners, colors = written
    content = read("a.glb", data)
    assert isinstance(content, Mesh)
    edges = [np.linalg.norm(corners[k] - corners[0]) for k in (1, 2, 4)]
    assert_solid(content, corners, None if colors is None else np.asarray(to_srgb(colors)), float(np.prod(edges)))
