"""Training in Chromium by WebGPU in software: its quality, and what happens when the device is lost."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.trainer.config import StepConfig, TrainingConfig
from mplicits.trainer.mining_config import MiningConfig
from mplicits.web.bundle import modules, script
from mplicits.web.compile_kernel import SOURCE
from mplicits.web.studio_page import kernel
from support import needs
from support.ball_training import QUICK
from support.page_scripts import BYTES, TRAINING, packed, run

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

STEPS, STAGES, BATCH = 120, 2, 256
TRIED = 20
"""Steps of a stage that the workers take, too."""
IDLE = STAGES + len(MiningConfig().schedule)
"""Steps of an idle network: at the start of a stage, and after each mining of the level."""
TRAIN = """async ([worker, wasm, vertices, faces, settings, config, gpu, lostAt]) => {
    const {requestDevice} = GPUAdapter.prototype, {submit} = GPUQueue.prototype;
    const counts = {gpu: 0, workers: 0, steps: 0};
    let device = null;
    GPUAdapter.prototype.requestDevice = async function () { return device = await requestDevice.call(this); };
    GPUQueue.prototype.submit = function (work) { ++counts.gpu; submit.call(this, work); };
    const team = new Team(worker, 2), module = await WebAssembly.compile(bytesOf(wasm)), all = team.all.bind(team);
    team.all = (name, data) => { counts.workers += name === "step"; return all(name, data); };
    const mesh = {vertices: new Float64Array(bytesOf(vertices)), faces: new Uint32Array(bytesOf(faces))};
    mesh.colors = {vertex: new Float32Array(mesh.vertices.length).fill(0.7), materials: [{color: [1, 1, 1]}]};
    await team.all("load", () => ({module, read: mesh}));
    const afterStep = ({steps}) => { ++counts.steps; if (steps === lostAt) device.destroy(); };
    const options = {module, hasColors: true, gpu, clock: () => 0, end: 1, afterStep};
    const trained = await trainShape(team, settings, config, options);
    team.dismiss();
    Object.assign(GPUAdapter.prototype, {requestDevice});
    Object.assign(GPUQueue.prototype, {submit});
    const [{meanF, angle}] = trained.levels;
    return {...counts, meanF, angle, colorLoss: trained.texture.loss};
}"""
LATE = """async ([network, isEnded]) => {
    let compile, destroyed = 0, asked = 0;
    const same = () => ({}), compiled = new Promise((resolve) => { compile = resolve; });
    const device = {
        queue: {}, lost: new Promise(() => {}), limits: {maxStorageBufferBindingSize: 1 << 27},
        createShaderModule: same, createComputePipelineAsync: () => compiled, createBuffer: same, createBindGroup: same,
        destroy: () => ++destroyed,
    };
    GPU.prototype.requestAdapter = async () => ({info: {}, requestDevice: async () => device});
    const all = async (name) => {
        asked += name === "samples";
        return name === "samples" ? new Promise(() => {}) : [{loss: 1}]; // the GPU's step stays at its samples
    };
    const stepper = await stepperOf({workers: [0], all}, "the kernel", network, 32, false);
    await stepper.all("step", same);
    const before = asked;
    if (isEnded) stepper.end();
    compile({getBindGroupLayout: same});
    await new Promise((resolve) => setTimeout(resolve));
    if (!isEnded) stepper.all("step", same);
    await new Promise((resolve) => setTimeout(resolve));
    return {before, destroyed, joined: asked > 0};
}"""


@pytest.fixture
def page(browser: "Browser", tmp_path: Path) -> "Page":
    path = tmp_path / "empty.html"  # WebGPU needs a page with an address
    path.write_text("<!doctype html><title>empty</title>")
    page = browser.new_page()
    page.goto(path.as_uri())
    page.evaluate(BYTES)
    if not page.evaluate("async () => Boolean(await navigator.gpu?.requestAdapter())"):
        needs.lack("WebGPU in Chromium")
    return page


def train(page: "Page", is_forced: bool = True, lost_at: int | None = None) -> Any:
    """Train a ball with a color on a GPU: one level, and the texture."""
    mesh, network = trimesh.creation.icosphere(subdivisions=3), {"width": 14, "depth": 1}
    settings = {"levels": [network], "texture": network, "omegas": [8, 16], "steps": [STEPS] * STAGES, "seed": 3}
    quick = TrainingConfig(step=StepConfig(batch=BATCH), sampling=QUICK.sampling, measuring=QUICK.measuring)
    arguments: list[Any] = [script(modules("worker.js")), packed(np.frombuffer(kernel(), np.uint8))]
    arguments += [packed(np.asarray(mesh.vertices, np.float64)), packed(np.asarray(mesh.faces, np.uint32))]
    arguments += [{**settings, "isOnGpu": is_forced}, dataclasses.asdict(quick)]
    return run(
        page,
        TRAINING,
        TRAIN,
        [*arguments, SOURCE.with_name("step.wgsl").read_text(), lost_at],
    )


@pytest.mark.slow
def test_the_gpu_trains_as_well_as_the_workers(page: "Page") -> None:
    on_gpu, on_workers = train(page), train(page, is_forced=False)
    assert (on_gpu["gpu"], on_gpu["workers"]) == (STAGES * STEPS + IDLE, STAGES * TRIED)
    assert (on_workers["gpu"], on_workers["workers"]) == (0, STAGES * STEPS + IDLE)  # a GPU in software is left alone
    for key in ("meanF", "angle", "colorLoss"):
        assert on_gpu[key] == pytest.approx(on_workers[key], rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("lost_at", [2 * TRIED, TRIED // 2])
def test_a_lost_device_goes_on_in_the_workers(page: "Page", lost_at: int) -> None:
    """It is lost while both take the steps, and while it takes them alone."""
    trained = train(page, lost_at=lost_at)
    assert trained["steps"] == STAGES * STEPS
    assert trained["gpu"] <= STAGES * (lost_at + 1) + IDLE
    assert trained["meanF"] < 0.02


@pytest.mark.parametrize("is_ended", [False, True])
def test_the_workers_begin_while_the_kernel_compiles(page: "Page", is_ended: bool) -> None:
    """A kernel that comes after the end of its stage is freed; an earlier one joins the workers' next step."""
    network = {"width": 16, "depth": 1, "outputs": 1}
    assert run(page, TRAINING, LATE, [network, is_ended]) == {
        "before": 0,
        "destroyed": int(is_ended),
        "joined": not is_ended,
    }
