"""Distances between the surfaces of a model and a shape, against trimesh, marching cubes and formulas."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.extract import extract_model
from mplicits.mesher.metrics import SampledSurface
from mplicits.model.model import Model
from mplicits.model.surface_figures import FAR, SurfaceRecord, surface_record
from mplicits.trainer.networks.network import from_model
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from mplicits.trainer.surface_distance import SurfaceDistance
from support.ball_training import CPU, train, use_quick_config


def networks(model: Model) -> tuple[list[list], list[float]]:  # type: ignore[type-arg]
    return [from_model(level.network) for level in model.levels], [level.delta for level in model.levels]


def measured(model: Model, shape: Shape) -> SurfaceRecord:
    return SurfaceDistance(shape, CPU).measure(*networks(model))


def meshed(model: Model, count: int = 1000) -> Doubles:
    """Draw samples of the model's surface by marching cubes."""
    return SampledSurface(extract_model(model, 64).mesh).sample(count, np.random.default_rng(0))[0]


def distances(mesh: trimesh.Trimesh, points: Doubles) -> Doubles:
    closest = trimesh.proximity.closest_point_naive
    return np.concatenate([closest(mesh, part)[1] for part in np.array_split(points, len(points) // 100)])  # type: ignore[no-untyped-call]


def test_the_crossings_of_random_lines_are_uniform_by_area(ball: Shape, model: Model) -> None:
    points = SurfaceDistance(ball, CPU).samples(*networks(model))
    assert len(points) == pytest.approx(2 * 16_384 / 1.02**2, rel=0.02), "lines that meet a sphere cross it twice"
    assert np.abs(np.linalg.norm(points, axis=1) - 1).max() < 0.02
    for axis in range(3):  # Archimedes: the coordinates of uniform points of a sphere are uniform.
        np.testing.assert_allclose(np.quantile(points[:, axis], (0.25, 0.5, 0.75)), (-0.5, 0, 0.5), atol=0.03)


def test_distances_of_both_directions_are_those_of_marching_cubes(ball: Shape, model: Model) -> None:
    record = measured(model, ball)
    figures = record.shape
    expected = distances(trimesh.creation.icosphere(4), meshed(model)).mean()
    assert figures.distance_mean == pytest.approx(expected, rel=0.1)
    assert figures.missing_mean == pytest.approx(expected, rel=0.1), "a ball is as far from a ball as that from it"
    assert figures.distance == pytest.approx(expected, rel=0.1)
    assert figures.normal_angle == pytest.approx(model.provenance["levels"][-1]["angle"], rel=0.05)
    assert figures.invented == 0
    assert not record.open


def test_the_surface_over_a_window_is_invented(model: Model, tmp_path: Path) -> None:
    """A window in a sphere, away from the axes, leaves the bounding box and so the place of the mesh."""
    mesh = trimesh.creation.icosphere(3)
    window = np.degrees(np.arccos(mesh.triangles_center @ np.ones(3) / 3**0.5)) < 35
    mesh.update_faces(~window)
    mesh.export(tmp_path / "window.ply")
    shape, _ = load_shape(str(tmp_path / "window.ply"))
    record = measured(model, shape)
    expected = (distances(mesh, meshed(model, 3000)) > FAR).mean()
    assert 0.05 < expected < 0.12
    assert record.shape.invented == pytest.approx(expected, abs=0.025)
    assert record.open
    assert record.shape.missing_mean < 3e-3, "from the mesh to the model nothing is missing"
    assert record.shape.distance_mean is not None
    assert record.shape.distance_mean > 5 * record.shape.missing_mean
    assert "--thicken 0.02" in record.warning()
    assert record.warning().startswith(f"{record.shape.invented:.0%} of the model's surface")


def test_missing_surface_counts_in_the_other_direction(model: Model, tmp_path: Path) -> None:
    """The shape has a small ball inside; the model has not."""
    inner = trimesh.creation.icosphere(3, 0.3)
    mesh: Any = trimesh.util.concatenate([trimesh.creation.icosphere(4), inner])
    mesh.export(tmp_path / "two.ply")
    figures = measured(model, load_shape(str(tmp_path / "two.ply"))[0]).shape
    share = 0.3**2 / (1 + 0.3**2)
    assert figures.missing_mean == pytest.approx(share * 0.7, rel=0.1)
    assert figures.distance_mean is not None
    assert figures.distance_mean < 3e-3
    assert figures.invented == 0


@pytest.mark.slow
def test_figures_against_flat_faces_are_told_where_they_differ(tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(1)
    mesh.export(tmp_path / "coarse.ply")
    model = train(load_shape(str(tmp_path / "coarse.ply"), crease=60.0)[0])
    record = surface_record(model.provenance)
    assert record is not None
    assert record.flat is not None
    mesh.apply_scale(1 / model.scale)
    points = meshed(model)
    assert record.flat.distance_mean is not None
    assert record.shape.distance_mean is not None
    assert record.flat.distance_mean == pytest.approx(distances(mesh, points).mean(), rel=0.05)
    assert record.flat.distance_mean > 3 * record.shape.distance
    assert [label for label, _ in record.told()] == ["surface", "flat faces"]
    flat = measured(model, load_shape(str(tmp_path / "coarse.ply"))[0])
    assert flat.flat is None
    assert len(flat.told()) == 1


def test_a_noisy_cloud_is_measured_in_one_direction(tmp_path: Path, model: Model) -> None:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for noise, known in ((0.0, True), (0.02, False)):
        points = normals + noise * rng.normal(size=normals.shape)
        np.savez(tmp_path / "cloud.npz", points=points, normals=normals)
        figures = measured(model, load_shape(str(tmp_path / "cloud.npz"), noise=noise)[0]).shape
        assert (figures.distance_mean is not None) == known
        assert ("both" if known else "one direction") in figures.told()
        assert figures.missing_mean < 0.03


def box_without_lid() -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((1.0, 1.0, 1.0)).subdivide_to_size(0.15)
    mesh.update_faces(mesh.triangles_center[:, 1] < 0.499)
    return mesh


def cylinder_without_caps() -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.cylinder(0.4, 1.0).subdivide_to_size(0.15)
    mesh.update_faces(np.abs(mesh.triangles_center[:, 2]) < 0.499)
    return mesh


def cabin_with_windows() -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.box((1.0, 0.8, 1.2)).subdivide_to_size(0.06)
    x, y, z = np.abs(mesh.triangles_center.T)
    mesh.update_faces((y > 0.25) | ((x > 0.3) & (z > 0.4)) | (np.minimum(x, z) < 0.05))
    return mesh


OPEN = {"box": box_without_lid, "cylinder": cylinder_without_caps, "cabin": cabin_with_windows}


@pytest.mark.slow
@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("thicken", [False, True])
def test_invented_surface_is_told_at_the_end_of_a_training(
    name: str, thicken: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    use_quick_config(monkeypatch)
    path, shape = tmp_path / "m.safetensors", tmp_path / "open.ply"
    OPEN[name]().export(shape)
    argv = ["train", str(shape), "-o", str(path), "--levels", "24x1,24x1", "--steps", "200,300", "--quiet", "--json"]
    assert cli.main([*argv, *(["--thicken", "0.05"] if thicken else [])]) == 0
    out, err = capsys.readouterr()
    report = json.loads(out)
    share = report["surface"]["shape"]["invented"]
    lines = [line for line in report["warnings"] if "radii from the shape" in line]
    if thicken:
        assert not report["surface"]["open"]
        assert not any("--thicken" in line for line in lines)
        return
    assert share > 0.05
    assert report["surface"]["shape"]["distance_mean"] > 2 * report["surface"]["shape"]["missing_mean"]
    assert [line for line in err.splitlines() if "--thicken 0.02" in line] == [f"warning: {lines[0]}"]
    assert cli.main(["info", str(path)]) == 0
    assert lines[0] in capsys.readouterr().out
    argv = ["eval", str(path), str(shape), "--resolution", "64", "--samples", "5000", "--quiet"]
    assert cli.main([*argv, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["invented"] == pytest.approx(share, abs=0.06)
    assert cli.main(argv) == 0
    assert "--thicken 0.02" in capsys.readouterr().out
