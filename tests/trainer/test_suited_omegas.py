"""The default frequencies follow the bend of a shape; frequencies that the user names stay."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.model.model_file import load
from mplicits.trainer import settings
from mplicits.trainer.config import BendConfig
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.suited_omegas import bend_of, roughness, suited_omega, suited_omegas
from support import needs
from support.ball_training import Log, use_quick_config
from support.paths import DATA

CONFIG = BendConfig()
BETWEEN = np.sqrt((CONFIG.nearest**2 + CONFIG.farthest**2) / 2)
"""Median distance of neighbors on a plane."""
SIZES = ((48, 1), (64, 4))
BUNNY = DATA / "meshes" / "bunny.ply"


def test_a_ball_bends_by_the_distance_of_its_points() -> None:
    ball, _ = load_shape(trimesh.creation.icosphere(subdivisions=5))
    assert bend_of(ball) == pytest.approx(np.degrees(BETWEEN), rel=0.05)


def test_sharp_edges_do_not_count() -> None:
    box, _ = load_shape(trimesh.creation.box((1, 2, 3)), crease=30)
    assert bend_of(box) < 0.01


def test_random_normals_bend_most() -> None:
    rng = np.random.default_rng(0)
    points, normals = (rng.normal(size=(20_000, 3)) for _ in range(2))
    cloud, _ = load_shape((points / np.linalg.norm(points, axis=1)[:, None], normals), noise=0.0)
    assert bend_of(cloud) > CONFIG.rough


def test_few_points_and_motions_keep_the_default() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    cloud, _ = load_shape((np.asarray(ball.vertices), np.asarray(ball.vertex_normals)), noise=0.0)
    assert roughness(bend_of(cloud)) == 1
    assert roughness(bend_of(cast(Shape, SimpleNamespace(moving=True)))) == 1


@pytest.mark.parametrize(
    ("bend", "share"),
    [(0, 0), (CONFIG.smooth, 0), ((CONFIG.smooth + CONFIG.rough) / 2, 0.5), (CONFIG.rough, 1), (np.inf, 1)],
)
def test_frequencies_rise_from_smooth_to_rough(bend: float, share: float) -> None:
    assert roughness(bend) == pytest.approx(share)
    usual, least = settings.default_omega(1, 64), CONFIG.omegas[1]
    assert suited_omega(1, 64, share) == pytest.approx(least + share * (usual - least))


def test_narrow_networks_get_no_more_than_usual() -> None:
    assert suited_omega(0, 2, 0.5) == settings.default_omega(0, 2) < CONFIG.omegas[0]


def test_the_log_names_the_frequencies() -> None:
    ball, _ = load_shape(trimesh.creation.icosphere(subdivisions=4))
    log = Log()
    first, second = suited_omegas(ball, SIZES, log.say)
    assert (first, second) == CONFIG.omegas[:2]
    assert log.lines == [f"omega: {first:g}, {second:g}; lower than usual, since the shape is smooth"]


def test_suited_frequencies_are_in_the_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_quick_config(monkeypatch)
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(subdivisions=3).export("ball.ply")
    assert cli.main(["train", "ball.ply", "--levels", "8x0,8x1", "--steps", "20", "--quiet"]) == 0
    made = load(tmp_path / "ball.safetensors").provenance["settings"]["omegas"]
    assert made == pytest.approx([suited_omega(i, 8, 0) for i in (0, 1)], abs=0.051)


@needs.data(BUNNY)
@pytest.mark.slow
def test_scans_keep_the_default() -> None:
    bunny, _ = load_shape(str(BUNNY), crease=30)
    assert roughness(bend_of(bunny)) == 1
