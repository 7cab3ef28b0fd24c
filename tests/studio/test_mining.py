"""Hard-example mining in the studio's worker: which samples it finds for levels that are wrong by a known amount."""

from typing import TYPE_CHECKING

import igl
import numpy as np
import pytest
import trimesh

from mplicits.trainer.config import SamplingConfig
from mplicits.trainer.mining_config import MiningConfig
from mplicits.web.bundle import modules
from support.page_scripts import BYTES, packed, run

if TYPE_CHECKING:
    from playwright.sync_api import Browser

RADIUS, DELTA, NEAR = 0.5, 0.05, 0.003
MINE = """([vertices, faces, isFirst, radius, delta, near, error, sampling, mining]) => {
    const shape = new Shape(new Float64Array(bytesOf(vertices)), new Uint32Array(bytesOf(faces)));
    const add = (term) => (rows) => {
        for (let at = 0; at < rows.length; at += SAMPLE) {
            rows[at + VALUE] += term(Math.hypot(rows[at], rows[at + 1], rows[at + 2]) - radius);
        }
    };
    const addFrozen = add((distance) => isFirst ? 0 : Math.abs(distance) < delta ? distance : Infinity);
    const level = {isFirst, delta, near, addFrozen, addLevel: add((distance) => isFirst ? error : -error)};
    const config = {sampling, mining}, random = randomNumbers(1);
    const found = hardSamples(shape, level, new Float32Array(0), 4000, config, random);
    return [found, hardSamples(shape, level, found, 4000, config, random)].map((rows) => [...rows]);
}"""


@pytest.mark.parametrize(
    ("is_first", "error", "ranges"),
    [
        (True, 0.05, [(-0.05 / 1.1, -NEAR), (NEAR, 0.05 / 1.1)]),  # f = 0.05 exceeds smaller distances
        (
            False,
            0.01,
            [(-DELTA, -NEAR), (0.001, 0.01 / 0.7)],
        ),  # f = distance - 0.01: too long inside
    ],
)
def test_samples_are_where_a_level_is_wrong(
    browser: "Browser", is_first: bool, error: float, ranges: list[tuple[float, float]]
) -> None:
    page = browser.new_page()
    page.evaluate(BYTES)
    mesh = trimesh.creation.icosphere(4, RADIUS)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    config = [vars(SamplingConfig()), {k: v for k, v in vars(MiningConfig()).items() if k != "thin"}]
    arguments = [packed(vertices), packed(faces.astype(np.uint32)), is_first, RADIUS, DELTA, NEAR, error, *config]
    first, second = (np.array(rows).reshape(-1, 12) for rows in run(page, modules("worker.js")[:-1], MINE, arguments))
    for rows in (first, second):
        points, distance = rows[:, :3], rows[:, 8]
        exact = np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])
        np.testing.assert_allclose(np.abs(distance), exact, atol=1e-6)
        sag = 2e-3  # at most between the mesh and the ball
        np.testing.assert_allclose(distance, np.linalg.norm(points, axis=1) - RADIUS, atol=sag)
        inside = [(distance > low - sag) & (distance < high + sag) for low, high in ranges]
        assert (inside[0] | inside[1]).all()
        for (low, high), some in zip(ranges, inside, strict=True):
            found = distance[some]
            assert found.min() < low + 0.1 * (high - low) + sag
            assert found.max() > high - 0.1 * (high - low) - sag
        assert rows[:, 9].all()  # marked for the kernel
        assert (rows[:, 4] == 0).all() if is_first else (np.abs(rows[:, 4] - distance) < sag).all()
    assert len(second) > 1.05 * len(first)  # some are found around the earlier ones
