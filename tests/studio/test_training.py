"""The studio's scripts in Chromium: the optimizer, distances, and the training of a mesh to a model file."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import igl
import numpy as np
import pytest
import torch
import trimesh

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model_file import load
from mplicits.trainer import tracing
from mplicits.trainer.config import TrainingConfig
from mplicits.trainer.networks.fit import schedule
from mplicits.trainer.networks.muon import Muon
from mplicits.trainer.networks.network import from_model
from mplicits.web.bundle import modules, script
from mplicits.web.studio_page import kernel
from support.ball_training import QUICK
from support.page_scripts import BYTES, TRAINING, packed, run

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SHAPE = modules("worker.js")[:-1]
DISTANCES = """([vertices, faces, points]) => {
    const at = new Float64Array(bytesOf(points));
    const shape = new Shape(new Float64Array(bytesOf(vertices)), new Uint32Array(bytesOf(faces)));
    return Array.from({length: at.length / 3}, (_, i) => shape.distance(at[3 * i], at[3 * i + 1], at[3 * i + 2]));
}"""
STEPS = """async ([wasm, start, gradients, task]) => {
    const {instance: {exports: kernel}} = await WebAssembly.instantiate(bytesOf(wasm));
    const optimizer = new Optimizer(new Float32Array(bytesOf(start)), {...task, kernel}, task.rate);
    gradients.forEach((text, k) => {
        const gradient = new Float32Array(bytesOf(text));
        optimizer.step([gradient, gradient], schedule(k / gradients.length));
    });
    return [...optimizer.weights];
}"""
TRAIN = """async ([worker, wasm, vertices, faces, crease, settings, config]) => {
    const team = new Team(worker, 2), module = await WebAssembly.compile(bytesOf(wasm)), told = [];
    const mesh = {vertices: new Float64Array(bytesOf(vertices)), faces: new Uint32Array(bytesOf(faces))};
    const earlier = {...mesh, normals: null, cloudNormals: null, colors: null, center: [0, 0, 0], scale: 1};
    const {preview, ...read} = await team.ask(0, "read", {earlier, crease, plain: [1, 1, 1]});
    await team.all("load", () => ({module, read}));
    const afterStep = ({stage, steps, loss}) => { told.push([stage, steps, loss]); };
    const trained = await trainShape(team, settings, config, {module, clock: () => 0, end: 1, afterStep});
    team.dismiss();
    const figures = trained.levels.map(({meanF, angle}) => [meanF, angle]);
    const shape = {name: "a ball", center: [1, 2, 3], scale: 4};
    return {told, figures, scale: read.scale, file: [...modelFile(shape, trained, {made_by: "page"})]};
}"""
TIMER = """([first, end]) => {
    let now = 5; // seconds; a step takes one
    const share = timer(first, 20, () => now, end), shares = [share(0)];
    while (shares.at(-1) < 1) {
        ++now;
        shares.push(share(shares.length));
    }
    return shares;
}"""
STEP_COUNT = 20
SETTINGS = {"levels": [{"width": 14, "depth": 1}] * 2, "omegas": [8, 16], "steps": [200, 200], "seed": 3}


@pytest.fixture
def page(browser: "Browser") -> "Page":
    page = browser.new_page()
    page.evaluate(BYTES)
    return page


@pytest.mark.parametrize("first", [0, 0.5])
def test_a_stage_without_time_takes_its_least_steps(page: "Page", first: float) -> None:
    """Its schedule passes in 20 steps, whether its time was over before, ends early, or is longer."""
    for end, count in {3: 20, 5: 20, 9: 20, 45: 40}.items():
        np.testing.assert_allclose(
            run(page, TRAINING, TIMER, [first, end]),
            np.linspace(first, 1, count + 1),
        )


@pytest.mark.parametrize(("width", "padded", "depth"), [(8, 8, 1), (10, 12, 3), (80, 80, 2), (8, 8, 0)])
def test_the_optimizer_is_the_command_s(page: "Page", width: int, padded: int, depth: int) -> None:
    """The page's weights, without padding neurons, are those of `mplicits train`; padding neurons stay zero."""
    generator = torch.Generator().manual_seed(width)
    sizes = [(width, 4), (width,), *[(width, width), (width,)] * depth, (1, width), (1,)]
    weights, *gradients = ([torch.randn(size, generator=generator) for size in sizes] for _ in range(1 + STEP_COUNT))

    def with_padding(parts: list[torch.Tensor]) -> np.ndarray:
        wider = [np.pad(part, [(0, padded - n if n == width else 0) for n in part.shape]) for part in parts]
        return np.concatenate([part.ravel() for part in wider])

    task = {"network": {"width": padded, "depth": depth}, "layout": {"width": width}, "outputs": padded + 1}
    task |= {"rate": 0.02, "outputFactor": 0.3}
    halves = [packed(with_padding(parts) / 2) for parts in gradients]
    arguments = [packed(np.frombuffer(kernel(), np.uint8)), packed(with_padding(weights)), halves, task]
    ours = run(page, ("kernel.js", "optimizer.js"), STEPS, arguments)
    optimizer = Muon(weights, 0.02, 0.3)
    for step, parts in enumerate(gradients):
        for weight, part in zip(weights, parts, strict=True):
            assert weight.grad is not None
            weight.grad += part
        optimizer.step(schedule(step / STEP_COUNT))
    np.testing.assert_allclose(ours, with_padding(weights), atol=5e-6)


def test_distances_and_signs_are_libigl_s(page: "Page") -> None:
    mesh = trimesh.creation.torus(0.7, 0.25, 60, 30)
    hole = mesh.faces[np.asarray(mesh.triangles_center)[:, 2] < 0.24]  # an open mesh
    doubled = np.concatenate((hole, hole[:50], [[0, 0, 1]]))  # twofold faces, and one without area
    rng = np.random.default_rng(1)
    points = rng.uniform(-1, 1, (20_000, 3))
    points[:5000] = mesh.vertices[rng.integers(len(mesh.vertices), size=5000)] + rng.normal(scale=0.01, size=(5000, 3))
    vertices, faces = np.asarray(mesh.vertices, np.float64), doubled.astype(np.int64)
    arguments = [packed(vertices), packed(faces.astype(np.uint32)), packed(points)]
    ours = np.array(run(page, SHAPE, DISTANCES, arguments))
    exact = np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])
    np.testing.assert_allclose(np.abs(ours), exact, atol=1e-9)
    winding = np.asarray(igl.winding_number(vertices, faces, points))
    decided = np.abs(winding - 0.5) > 0.02
    assert decided.mean() > 0.98
    assert ((ours < 0) == (winding > 0.5))[decided].all()


def trained_in(page: "Page", mesh: trimesh.Trimesh, crease: float | None) -> Any:
    """Train a mesh in model space by TRAIN."""
    quick = dataclasses.replace(TrainingConfig(), sampling=QUICK.sampling, measuring=QUICK.measuring)
    arguments = [script(modules("worker.js")), packed(np.frombuffer(kernel(), np.uint8))]
    arguments += [packed(np.asarray(mesh.vertices, np.float64)), packed(np.asarray(mesh.faces, np.uint32))]
    return run(
        page,
        TRAINING,
        TRAIN,
        [*arguments, crease, SETTINGS, dataclasses.asdict(quick)],
    )


@pytest.mark.slow
def test_a_coarse_ball_becomes_a_ball(page: "Page", tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=1)
    trained = trained_in(page, mesh, 30.0)
    path = tmp_path / "m.safetensors"
    path.write_bytes(bytes(trained["file"]))
    points = np.random.default_rng(0).normal(size=(5000, 3))
    points /= trained["scale"] * np.linalg.norm(points, axis=1, keepdims=True)
    f = interpret.field(lower(load(path)), points.astype(np.float32), 2)
    facets = 1 - np.linalg.norm(trimesh.sample.sample_surface(mesh, 5000, seed=1)[0], axis=1)
    assert np.abs(f).mean() < 0.2 * facets.mean()
    assert trained["figures"][1][1] < 5


@pytest.mark.slow
def test_a_trained_mesh_becomes_a_model_file(page: "Page", tmp_path: Path) -> None:
    """The file holds the field that was trained, and its figures are true."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    trained = trained_in(page, mesh, None)
    assert [told[:2] for told in trained["told"]] == [[level, step] for level in (0, 1) for step in range(1, 201)]
    assert trained["told"][199][2] < trained["told"][20][2]
    path = tmp_path / "m.safetensors"
    path.write_bytes(bytes(trained["file"]))
    model = load(path)
    assert (model.name, model.center, model.scale) == ("a ball", (1, 2, 3), 4)
    assert model.parameters() == 2 * (14 * 4 + 14 * 15 + 15)
    surface = np.asarray(trimesh.sample.sample_surface(mesh, 5000, seed=1)[0], np.float32)
    program = lower(model)
    for level, (mean_f, angle) in enumerate(trained["figures"], start=1):
        f = np.abs(interpret.field(program, surface, level))
        assert mean_f == pytest.approx(f.mean(), rel=0.1)
        corners = np.abs(interpret.field(program, np.asarray(mesh.vertices, np.float32), level))
        assert max(f.max(), corners.max()) < model.levels[level - 1].delta
        assert angle < 10
    assert trained["figures"][1][0] < 0.5 * trained["figures"][0][0] < 0.01
    weights, deltas = [from_model(level.network) for level in model.levels], [level.delta for level in model.levels]
    for count in (1, 2):
        bounds = tracing.measure(weights[:count], deltas[:count], torch.from_numpy(surface)).step_bounds
        found = [level.band_step_bound for level in model.levels[: count - 1]] + [model.levels[count - 1].step_bound]
        np.testing.assert_allclose(found, bounds, atol=0.06)
    points = np.random.default_rng(2).uniform(-1, 1, (4000, 3)).astype(np.float32)
    truth = np.linalg.norm(points, axis=1) - 1
    assert (interpret.field(program, points, 1) * truth > 0)[np.abs(truth) > 0.05].mean() > 0.95
