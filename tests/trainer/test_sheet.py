"""Thickened open sheets, and distances to meshes of many faces."""

from pathlib import Path
from time import process_time

import igl
import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.trainer.shapes import mesh_distance
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh_distance import MeshDistance
from mplicits.trainer.shapes.shape import Doubles

T = 0.05


def sheet(folder: Path) -> str:
    """Write a square in the plane z = 0, 2 wide, red at x = -1 and black at x = 1."""
    sides = np.linspace(-1, 1, 21)
    grid = np.stack(np.meshgrid(sides, sides, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1)
    faces = np.concatenate([corner[:, None] + pattern for pattern in ((0, 21, 1), (1, 21, 22))])
    colors = np.zeros((len(grid), 3), np.uint8)
    colors[:, 0] = 127.5 * (1 - grid[:, 0])
    trimesh.Trimesh(grid, faces, vertex_colors=colors).export(folder / "sheet.ply")
    return str(folder / "sheet.ply")


def around_square(points: Doubles, half: float) -> Doubles:
    """Distance to the square."""
    outside = np.maximum(np.abs(points[:, :2]) - half, 0)
    return np.asarray(np.linalg.norm(np.concatenate((outside, points[:, 2:]), axis=1), axis=1))


def test_a_thickened_sheet_contains_all_points_near_the_sheet(tmp_path: Path) -> None:
    shape, warnings = load_shape(sheet(tmp_path), thicken=T)
    assert warnings == []
    assert shape.source["thicken"] == T
    assert shape.scale == pytest.approx(2**0.5 * (1 + T))
    half, thickness = 1 / shape.scale, T / (1 + T)
    probes = np.random.default_rng(0).uniform(-1, 1, (2000, 3))
    np.testing.assert_allclose(shape.distance(probes), around_square(probes, half) - thickness, atol=1e-9)
    drawn = shape.surface(20_000, np.random.default_rng(1), colors=True)
    assert np.abs(shape.distance(drawn.points)).max() < 1e-4
    assert np.linalg.norm(drawn.points, axis=1).max() <= 1 + 1e-6
    ahead, behind = (shape.distance(drawn.points + step * drawn.normals) for step in (1e-4, -1e-4))
    np.testing.assert_allclose((ahead - behind) / 2e-4, 1, atol=1e-3)
    assert drawn.colors is not None
    assert np.abs(drawn.colors[:, 0] - (1 - np.clip(drawn.points[:, 0] / half, -1, 1)) / 2).max() < 0.02
    rim = np.abs(drawn.points[:, :2]).max(axis=1) > half
    share = np.pi * thickness * 8 * half / (np.pi * thickness * 8 * half + 2 * (2 * half) ** 2)
    assert share / 4 < rim.mean() < share, "the rim has its points, too"
    assert np.abs(shape.distance(shape.inputs())).max() < 1e-4


def test_thicken_refuses_all_but_open_sheets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.creation.icosphere(2).export(tmp_path / "ball.ply")
    np.savez(tmp_path / "cloud.npz", points=np.random.default_rng(0).normal(size=(200, 3)))
    with pytest.raises(UserError, match="is closed"):
        load_shape(str(tmp_path / "ball.ply"), thicken=T)
    with pytest.raises(UserError, match="this is a point cloud"):
        load_shape(str(tmp_path / "cloud.npz"), thicken=T)
    with pytest.raises(UserError, match="the demo shape is closed"):
        load_shape("demo", thicken=T)
    with pytest.raises(UserError, match=r"encloses no volume.*--thicken T"):
        load_shape(sheet(tmp_path))
    assert cli.main(["train", sheet(tmp_path), "--thicken", "nan", "-o", str(tmp_path / "m.safetensors")]) == 2
    assert "--thicken" in capsys.readouterr().err


def test_distances_to_many_faces_are_exact_near_and_accurate_far(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    tree = igl.AABB()
    tree.init(vertices, faces)
    areas = np.cumsum(mesh.area_faces)
    exact = MeshDistance(tree, vertices, faces, areas)
    monkeypatch.setattr(mesh_distance, "MANY", 1000)
    monkeypatch.setattr(mesh_distance, "SAMPLES", 100_000)
    many = MeshDistance(tree, vertices, faces, areas)
    points = np.random.default_rng(0).uniform(-1, 1, (3000, 3))
    points[:50] *= 1e-3
    truth, found = exact(points), many(points)
    near = truth < mesh_distance.NEAR
    np.testing.assert_array_equal(found[near], truth[near])
    error = found / truth - 1
    assert error.min() > -1e-12
    assert error.max() < 1e-2
    assert error.mean() < 1e-4
    assert many(points[:0]).shape == (0,)


def test_at_the_center_of_many_faces_the_tree_is_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """All faces are equally far there, so the tree would visit every face for every point."""
    searched = []

    class Tree:
        def squared_distance(self, vertices: Doubles, faces: Doubles, points: Doubles) -> tuple[Doubles, None, None]:
            searched.extend(np.linalg.norm(points, axis=1))
            return (1 - np.linalg.norm(points, axis=1)) ** 2, None, None

    monkeypatch.setattr(mesh_distance, "MANY", 1000)
    monkeypatch.setattr(mesh_distance, "SAMPLES", 100_000)
    mesh = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    many = MeshDistance(Tree(), vertices, faces, np.cumsum(mesh.area_faces))
    radii = np.linspace(0, 1, 500)
    found = many(radii[:, None] * (0.6, 0.0, 0.8))
    np.testing.assert_allclose(found, 1 - radii, atol=2e-3)
    assert 0.8 < min(searched) < 1 - mesh_distance.NEAR


def test_a_mesh_that_crosses_itself_everywhere_is_refused_in_seconds(tmp_path: Path) -> None:
    """A fan of thin triangles from corner to corner: what is inside would take minutes."""
    k = np.arange(10_000)
    points = np.stack((k / 1e4, np.where(k % 2, 1.0, 0.0), 0 * k), axis=1)
    faces = np.stack((0 * k[2:], k[1:-1], k[2:]), axis=1)
    trimesh.Trimesh(points, faces, process=False).export(tmp_path / "a.ply")
    began = process_time()
    with pytest.raises(UserError, match="the mesh encloses no volume"):
        load_shape(str(tmp_path / "a.ply"))
    assert process_time() - began < 15
