"""The studio in Chromium: a dropped mesh trains; what the page saves of it, opened by other readers."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import shadertoy
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.model.orientation import upright
from mplicits.model.quantize import is_quantized
from mplicits.viewer.draw.context import Context
from support.browser import Visit, visit
from support.shadertoy import picture
from support.studio_visit import ready, save, write_page
from support.tiny_visit import COUNT, still

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

EXTENTS, CENTER = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0])
COLOR = (230, 120, 40, 255)
ASKS = """() => {
    const event = new Event("beforeunload", {cancelable: true});
    dispatchEvent(event);
    return event.defaultPrevented;
}"""
"""Whether the page asks before it is left."""


def box() -> bytes:
    """Return a colored PLY file."""
    mesh = trimesh.creation.box(EXTENTS)
    mesh.apply_translation(CENTER)
    mesh.visual.vertex_colors = np.tile(np.array(COLOR, np.uint8), (8, 1))
    return bytes(mesh.export(file_type="ply"))


@pytest.fixture(scope="module")
def trained(browser: "Browser", tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    """The page after the training of a box."""
    file = write_page(tmp_path_factory.mktemp("studio") / "studio.html", 300)
    with visit(browser, file, size=(900, 500), share=0.1) as visited:
        ready(visited)
        assert not visited.page.evaluate(ASKS)
        visited.drop(box(), "a box.ply")
        visited.page.wait_for_selector("#download")
        yield visited
        assert visited.console == []


@pytest.fixture(scope="module")
def model(trained: Visit, tmp_path_factory: pytest.TempPathFactory) -> Model:
    """The model that the page saves at first."""
    assert trained.page.evaluate(ASKS)
    path = tmp_path_factory.mktemp("model") / "m.safetensors"
    assert save(trained, "#download", path) == "a-box.safetensors"
    assert not trained.page.evaluate(ASKS), "the model is saved"
    return load(path)


def in_file(model: Model, points: np.ndarray) -> np.ndarray:
    """Return the field at points of the file, in the file's units, with the sign as the model's."""
    local = (upright(points, model.up) - np.array(model.center)) / model.scale
    return interpret.field(lower(model), local.astype(np.float32), 1) * model.scale


def test_a_dropped_mesh_trains_to_a_model(trained: Visit, model: Model) -> None:
    trained.still()
    assert float(trained.root("error") or "nan") < 1e-5
    assert (model.name, model.provenance["made_by"]) == ("a box", "page")
    assert all(map(is_quantized, model.networks().values()))
    np.testing.assert_allclose(model.center, CENTER, atol=1e-6)
    assert model.scale == pytest.approx(np.linalg.norm(EXTENTS) / 2)
    points = trimesh.sample.sample_surface(trimesh.creation.box(EXTENTS), 2000, seed=0)[0] / model.scale
    f = np.abs(interpret.field(lower(model), points.astype(np.float32), 2)).mean()
    assert model.provenance["levels"][1]["mean_f"] == pytest.approx(f, rel=0.5)
    assert f < 0.02


def test_up_and_front_are_those_of_train(trained: Visit, model: Model, tmp_path: Path) -> None:
    """As `mplicits train --up z --front`: the field turns with the shape."""
    assert (model.up, model.front) == ("y", None)
    page = trained.page
    assert page.inner_text("#up") == "Up: Y"
    page.click("#up")
    trained.until("document.getElementById('up').textContent === 'Up: Z'")
    trained.follow("#az=70&el=-15")
    page.click("#front")
    trained.until("document.documentElement.dataset.error")
    save(trained, "#download", tmp_path / "m.safetensors")
    turned = load(tmp_path / "m.safetensors")
    assert (turned.up, turned.front) == ("z", (70.0, -15.0))
    np.testing.assert_allclose(turned.center, upright(CENTER, "z"), atol=1e-6)
    points = CENTER + np.random.default_rng(0).uniform(-1, 1, (1000, 3)) * EXTENTS / 2
    np.testing.assert_allclose(in_file(turned, points), in_file(model, points), atol=1e-4)
    assert np.ptp(in_file(model, points)) > 0.2
    for _ in range(5):
        page.click("#up")
    trained.until("document.getElementById('up').textContent === 'Up: Y'")


@pytest.mark.parametrize("ending", ["ply", "glb"])
def test_the_saved_mesh_is_the_shape(ending: str, trained: Visit, model: Model, tmp_path: Path) -> None:
    assert model.texture is not None
    path = tmp_path / f"box.{ending}"
    assert save(trained, f"#save-{ending}", path) == f"a-box.{ending}"
    mesh: Any = trimesh.load(path, force="mesh")
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.extents, EXTENTS, rtol=0.15)
    np.testing.assert_allclose(mesh.bounds.mean(axis=0), CENTER, atol=0.15)
    assert mesh.volume == pytest.approx(np.prod(EXTENTS), rel=0.15)
    colors = np.asarray(mesh.visual.vertex_colors).mean(axis=0)[:3] / 255
    if ending == "glb":
        colors **= 1 / 2.2  # glTF's colors are linear
    np.testing.assert_allclose(colors, np.array(COLOR[:3]) / 255, atol=0.1)


def test_saved_texts_are_python_s(trained: Visit, osmesa: Context, tmp_path: Path) -> None:
    save(trained, "#download", tmp_path / "m.safetensors")
    assert cli.main(["info", str(tmp_path / "m.safetensors")]) == 0
    save(trained, "#save-text", tmp_path / "text.frag")
    ours = picture(osmesa, (tmp_path / "text.frag").read_text())
    theirs = picture(osmesa, shadertoy.exact(load(tmp_path / "m.safetensors")))
    assert (np.abs(ours - theirs).max(-1) > 4).mean() < 0.01
    assert np.ptp(ours) > 100
    save(trained, "#save-glsl", tmp_path / "text.glsl")
    assert "float a_box(vec3 p)" in (tmp_path / "text.glsl").read_text()


def test_the_saved_tiny_page_is_python_s(trained: Visit, browser: "Browser", tmp_path: Path) -> None:
    save(trained, "#download", tmp_path / "m.safetensors")
    assert save(trained, "#save-tiny", tmp_path / "ours.html") == "a-box.tiny.html"
    (tmp_path / "theirs.html").write_text(TARGETS["tiny"](load(tmp_path / "m.safetensors")))
    pictures = []
    for name in ("ours.html", "theirs.html"):
        with visit(browser, tmp_path / name, share=0.2, script=COUNT) as visited:
            assert visited.page.title() == "a box"
            pictures.append(still(visited))
            assert visited.console == []
    # Edges differ where one page draws more samples a pixel.
    assert (np.abs(pictures[0] - pictures[1]).max(-1) > 4).mean() < 0.03
    assert np.ptp(pictures[0]) > 100
