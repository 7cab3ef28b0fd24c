"""Meshes of the studio in Chromium: functions against their exact surfaces, a model against the Python mesher."""

import base64
import dataclasses
import io
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import igl
import numpy as np
import pytest
import trimesh

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.mesher.compare import is_watertight
from mplicits.mesher.options import MeshOptions
from mplicits.mesher.triangle_mesh import make_mesh
from mplicits.model.gallery import FOLDER
from mplicits.model.model import Network
from mplicits.model.model_file import load
from mplicits.model.srgb import to_linear
from mplicits.web.bundle import modules, script
from mplicits.web.studio_page import kernel
from support.page_scripts import TRAINING, scope, unpacked
from support.page_scripts import packed as bytes_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser

OF_FUNCTION = """([body, resolution]) => {
    const at = (x, y, z) => FUNCTIONS[body](x, y, z), evaluate = (rows) => {
        for (let i = 0; i < rows.length; i += SAMPLE) rows.set(at(...rows.subarray(i, i + 3)), i + VALUE);
    };
    return textOf(plyBytes({...isosurface(evaluate, resolution, 0), colors: null}));
}"""
FUNCTIONS = """
const ballAt = (x, y, z, radius) => [Math.hypot(x, y, z) - radius, ...[x, y, z].map((c) => c / Math.hypot(x, y, z))];
const FUNCTIONS = {
    ball: (x, y, z) => ballAt(x, y, z, 0.8),
    torus(x, y, z) {
        const ring = Math.hypot(x, y), away = ring - 0.7, length = Math.hypot(away, z);
        return [length - 0.25, away / length * x / ring, away / length * y / ring, z / length];
    },
    steep: (x, y, z) => ballAt(x, y, z, 0.8).map((value) => (x > 0.1 ? 8 : 1) * value), // at a half: no distance
    plane: (x, y, z) => [z - 0.1, 0, 0, 1],
    noise(x, y, z) {
        const large = Math.sin(x * 127.1 + y * 311.7 + z * 74.7) * 43758.5453;
        return [0.01 * (large - Math.floor(large) - 0.5), 0, 0, 0];
    },
    specks(x, y, z) { // a ball, a tiny one, and a jump without a zero
        const ball = ballAt(x, y, z, 0.5), tiny = ballAt(x - 0.8, y, z, 0.04);
        return Math.hypot(x, y, z + 0.8) < 0.1 ? [-0.02, 0, 0, 0.01] : ball[0] < tiny[0] ? ball : tiny;
    },
    nothing: () => [NaN, NaN, NaN, NaN],
};"""
OF_MODEL = """async ([worker, wasm, question]) => {
    const team = new Team(worker, 1), module = await WebAssembly.compile(bytesOf(wasm));
    const read = {
        vertices: Float64Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1),
        faces: Uint32Array.of(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3),
    };
    await team.all("load", () => ({module, read}));
    const network = (of) => ({...of, weights: new Float32Array(bytesOf(of.weights))});
    const levels = question.levels.map(network), texture = network(question.texture);
    const answers = await Promise.all(["ply", "glb"].map((format) => (
        team.all("mesh", () => ({...question, format, levels, texture})))));
    team.dismiss();
    return Promise.all(answers.map(([{bytes}]) => textOf(bytes)));
}"""
OF_LEVELS = """async ([wasm, asked, text, margin]) => {
    const kernel = new Kernel(await WebAssembly.compile(bytesOf(wasm))), rows = new Float32Array(bytesOf(text));
    const levels = asked.map((level) => ({...level, weights: new Float32Array(bytesOf(level.weights))}));
    addNested(kernel, levels, rows, margin);
    return textOf(rows);
}"""
FIELD = ("training_error.js", "kernel.js", "kernel_instance.js", "sampling.js", "nested.js")
Meshed = Callable[..., Any]
SURFACE = ("training_error.js", "kernel.js", "marching.js", "isosurface.js", "mesh_writer.js")


@pytest.fixture(scope="module")
def meshed(browser: "Browser") -> Iterator[Meshed]:
    """Return a function that meshes one of FUNCTIONS."""
    with scope(browser, SURFACE, f"{FUNCTIONS} window.mesh = {OF_FUNCTION};") as page:
        yield lambda *asked: read(page.evaluate("asked => window.mesh(asked)", asked), "ply")


def read(text: str, kind: str) -> Any:
    scene: Any = trimesh.load_scene(io.BytesIO(base64.b64decode(text)), file_type=kind, process=False)
    (mesh,) = scene.geometry.values()
    return mesh


@pytest.mark.parametrize("name", ["ball", "torus", "steep", "plane"])
def test_the_surface_of_a_function_is_closed_and_exact(name: str, meshed: Meshed) -> None:
    mesh, tube, half = meshed(name, 60), 2 * math.pi**2 * 0.7 * 0.25**2, 1.02**2 * 0.1 - 0.1**3 / 3
    volume = {"torus": tube, "plane": math.pi * (1.02**3 * 2 / 3 + half)}.get(name, 4 / 3 * math.pi * 0.8**3)
    area = 4 * math.pi**2 * 0.7 * 0.25 if name == "torus" else 4 * math.pi * 0.8**2
    assert is_watertight(mesh.faces)
    assert mesh.euler_number == (0 if name == "torus" else 2)
    assert mesh.volume == pytest.approx(volume, rel=0.01)
    if name != "plane":
        assert mesh.area == pytest.approx(area, rel=0.003)
        x, y, z = mesh.vertices.T
        away = (
            np.hypot(np.hypot(x, y) - 0.7, z) - 0.25 if name == "torus" else np.linalg.norm(mesh.vertices, axis=1) - 0.8
        )
        assert np.abs(away).max() < 1e-5
        assert (np.einsum("ij,ikj->ik", mesh.face_normals, mesh.vertex_normals[mesh.faces]) > 0).all()


def test_ambiguous_cells_leave_no_hole(meshed: Meshed) -> None:
    """Random values reach all 256 kinds of cells."""
    mesh = meshed("noise", 32)
    assert len(mesh.faces) > 10_000
    assert is_watertight(mesh.faces)


def test_specks_and_jumps_are_dropped(meshed: Meshed) -> None:
    mesh = meshed("specks", 64)
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * 0.5**3, rel=0.01)
    with pytest.raises(Exception, match="there is no surface"):
        meshed("nothing", 16)


def packed(network: Network) -> dict[str, Any]:
    """Return a network in the kernel's order, with padding, as the page has it."""
    width, outputs = len(network[0].bias), len(network[-1].bias)
    pad, parts = -width % 4, []
    for j, layer in enumerate(network):
        rows, columns = (0 if j == len(network) - 1 else pad), (1 if j == 0 else pad)
        parts += [np.pad(layer.weight, ((0, rows), (0, columns))).ravel(), np.pad(layer.bias, (0, rows))]
    sizes = {"width": width + pad, "depth": len(network) - 2, "outputs": outputs}
    return {"network": sizes, "weights": bytes_of(np.concatenate(parts))}


def test_levels_are_nested_as_in_python(browser: "Browser") -> None:
    """Far from the surface, the last level may have zeros; only the levels before count there."""
    model = load(FOLDER / "bob-small.safetensors")
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    rows = np.zeros((len(points), 12), np.float32)
    rows[:, :3] = points
    levels = [packed(level.network) | {"delta": level.delta} for level in model.levels]
    arguments = [base64.b64encode(kernel()).decode(), levels, bytes_of(rows), 0.01]
    with scope(browser, FIELD, f"window.fieldAt = {OF_LEVELS};") as page:
        found = unpacked(page.evaluate("asked => window.fieldAt(asked)", arguments), "f4")
    f, reached = interpret.nested_field(lower(model), points, 2, 0.0, [0.01])
    near = (np.abs(np.abs(interpret.field(lower(model), points, 1)) - model.levels[0].delta - 0.01)) > 1e-5
    assert 100 < (reached == 2).sum() < 1000
    np.testing.assert_allclose(found.reshape(-1, 12)[near, 4], f[near], atol=1e-5)


def test_the_mesh_of_a_model_is_that_of_python(browser: "Browser") -> None:
    model = load(FOLDER / "bob-small.safetensors")
    model = dataclasses.replace(model, center=(1.0, 2.0, 3.0), scale=2.0)
    assert model.texture is not None
    levels = [packed(level.network) | {"delta": level.delta} for level in model.levels]
    place = {"center": model.center, "scale": model.scale}
    truth = make_mesh(model, MeshOptions(resolution=80, quiet=True)).to_trimesh()
    triangles = len(truth.faces)
    question = {"levels": levels, "texture": packed(model.texture), "triangles": triangles, "place": place}
    wasm = base64.b64encode(kernel()).decode()
    arguments = [script(modules("worker.js")), wasm, question]
    with scope(browser, TRAINING, f"window.mesh = {OF_MODEL};") as page:
        ply, glb = map(read, page.evaluate("asked => window.mesh(asked)", arguments), ("ply", "glb"))

    assert len(ply.faces) == pytest.approx(triangles, rel=0.05)
    for one, other in ((ply, truth), (truth, ply)):
        squared = igl.point_mesh_squared_distance(
            np.array(one.vertices), np.array(other.vertices), np.array(other.faces)
        )[0]
        distance = np.sqrt(squared) / model.scale
        assert distance.mean() < 2e-4
        assert distance.max() < 0.1 * 2 / 80
    assert is_watertight(ply.faces)
    assert ply.volume == pytest.approx(truth.volume, rel=1e-3)

    points = (np.array(ply.vertices) - model.center) / model.scale
    program = lower(model)
    assert np.abs(interpret.field(program, points.astype(np.float32), 2)).max() < 1e-4
    gradient, _ = interpret.field_gradient(program, points.astype(np.float32), 2)
    normals = np.array(glb.vertex_normals)
    assert np.einsum("ij,ij->i", normals, gradient / np.linalg.norm(gradient, axis=1, keepdims=True)).min() > 0.999
    colors = interpret.color(program, points.astype(np.float32))
    np.testing.assert_allclose(ply.visual.vertex_colors[:, :3], 255 * colors, atol=1.01)
    np.testing.assert_allclose(glb.visual.vertex_colors[:, :3], 255 * to_linear(colors), atol=1.01)
    np.testing.assert_allclose(glb.vertices, ply.vertices)
    rows = ply.metadata["_ply_raw"]["vertex"]["data"]  # trimesh computes normals anew
    np.testing.assert_allclose(glb.vertex_normals, np.stack([rows[name] for name in ("nx", "ny", "nz")], -1), atol=1e-6)
    assert (glb.faces == ply.faces).all()
