"""Clouds with the flaws of feed-forward models' output: noise, outliers, uneven density, no normals."""

from pathlib import Path
from typing import Any

import igl
import numpy as np
import pytest
import trimesh

from mplicits.mesher.compare import compare
from mplicits.mesher.extract import extract_model
from mplicits.mesher.read_meshes import in_model_space, read_mesh
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.orient import estimated_normals
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints, unit
from support import needs
from support.ball_training import SMALL_SETTINGS, train
from support.paths import DATA

SPOT = DATA / "textured" / "spot.obj"
NOISE, OUTLIERS = 0.01, 0.05
"""Standard deviation as a share of Spot's radius; number of outliers as a share of the other points."""
HARMONIC = 0.28209479
"""The constant spherical harmonic."""
needs_data = needs.data(SPOT)


def loose(count: int) -> SurfacePoints:
    """Draw colored points of Spot in its model space, ten times as dense at one end as at the other."""
    rng = np.random.default_rng(0)
    drawn = load_shape(str(SPOT))[0].surface(4 * count, rng, colors=True)
    along = (drawn.points[:, 0] - drawn.points[:, 0].min()) / np.ptp(drawn.points[:, 0])
    kept = rng.choice(4 * count, count, replace=False, p=(0.1 + 0.9 * along) / (0.1 + 0.9 * along).sum())
    away = int(OUTLIERS * count)
    assert drawn.colors is not None
    return SurfacePoints(
        np.concatenate((drawn.points[kept] + rng.normal(scale=NOISE, size=(count, 3)), rng.uniform(-1, 1, (away, 3)))),
        np.concatenate((drawn.normals[kept], unit(rng.normal(size=(away, 3))))),
        np.concatenate((drawn.colors[kept], rng.random((away, 3)))),
    )


def write(path: Path, cloud: SurfacePoints, kind: str) -> None:
    """Write a cloud without normals: an NPZ file, or a PLY file of Gaussian splats."""
    assert cloud.colors is not None
    if kind == "npz":
        np.savez(path, points=cloud.points, colors=cloud.colors)
        return
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    columns = np.column_stack((cloud.points, (cloud.colors - 0.5) / HARMONIC, np.full(len(cloud.points), 3.0)))
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
    lines = [*head, *(f"property float {name}" for name in names), "end_header", ""]
    path.write_bytes("\n".join(lines).encode() + columns.astype("<f4").tobytes())


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_normals_of_a_dense_noisy_cloud_follow_the_surface(noise: float) -> None:
    """At a spacing of 0.013, the twelve neighbors of a noisy point fill a ball, not a disc."""
    torus: Any = trimesh.creation.torus(0.7, 0.3, 128, 64)
    points, face = trimesh.sample.sample_surface(torus, 50_000, seed=1)
    rng = np.random.default_rng(0)
    moved = np.concatenate((points + rng.normal(scale=noise, size=points.shape), rng.uniform(-1, 1, (2500, 3))))
    normals: Doubles = estimated_normals(moved)[0][: len(points)]
    cosine = np.einsum("ij,ij->i", normals, np.asarray(torus.face_normals)[face])
    assert (cosine > 0).mean() > 0.99
    assert np.degrees(np.arccos(np.median(cosine))) < (10 if noise else 3)


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ply"])
def test_training_on_a_loose_cloud_yields_one_accurate_component(tmp_path: Path, kind: str) -> None:
    write(tmp_path / f"spot.{kind}", loose(30_000), kind)
    shape, warnings = load_shape(str(tmp_path / f"spot.{kind}"))
    assert "no normals; estimated, and oriented outwards in one component" in warnings[0]
    assert shape.source["noise"]["outliers"] == pytest.approx(OUTLIERS / (1 + OUTLIERS), rel=0.1)
    truth = in_model_space(read_mesh(SPOT), *_place())
    vertices, faces = np.asarray(truth.vertices, np.float64), np.asarray(truth.faces, np.int64)
    left = shape.inputs() * shape.scale + np.array(shape.center)
    off = np.sqrt(igl.point_mesh_squared_distance(left, vertices, faces)[0])
    assert np.sqrt((off**2).mean()) < NOISE / 2
    model = train(shape, SMALL_SETTINGS)
    assert model.colored
    mesh = extract_model(model, 96).mesh
    figures = compare(mesh, in_model_space(read_mesh(SPOT), *_place_of(model.center, model.scale)), 100_000)
    assert figures.components == 1
    assert figures.chamfer < 1e-3


def _place() -> tuple[tuple[float, float, float], float]:
    shape = load_shape(str(SPOT))[0]
    return shape.center, shape.scale


def _place_of(center: tuple[float, float, float], scale: float) -> tuple[tuple[float, float, float], float]:
    """Convert a center and scale from the cloud's space (Spot's model space) to the space of Spot's file."""
    own, unit_length = _place()
    x, y, z = (float(c) for c in np.array(own) + unit_length * np.array(center))
    return (x, y, z), scale * unit_length
