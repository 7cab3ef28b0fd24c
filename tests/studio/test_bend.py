"""The page's frequencies for a shape, in Chromium, against the Python trainer's."""

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from mplicits.readers.content import Mesh
from mplicits.readers.from_trimesh import of_mesh
from mplicits.readers.tidy import tidy
from mplicits.trainer import settings
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.mesh import MeshShape
from mplicits.trainer.suited_omegas import bend_of, suited_omegas
from mplicits.web.bundle import script
from mplicits.web.studio_page import page_facts
from support.page_scripts import WORKER, packed, scope

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BEND = """([vertices, faces, config]) => bendOf(
    new Shape(new Float64Array(bytesOf(vertices)), new Uint32Array(bytesOf(faces))), config)"""
SUITED = """([bend, omega]) => {
    const texts = {levels: "48x1,64x4", omegas: omega}, chosen = suitedSettings(settingsFrom("base", texts), bend);
    return [chosen.omegas, suitedSettings(chosen, 0).omegas];
}"""


def shape_of(mesh: trimesh.Trimesh) -> MeshShape:
    """Return the shape of a mesh with flat faces, as the page has it."""
    content = of_mesh(mesh)
    assert isinstance(content, Mesh)
    return MeshShape(tidy(content), "shape", {})


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.torus(0.7, 0.3, major_sections=512, minor_sections=192),
        trimesh.creation.torus(0.9, 0.1, major_sections=256, minor_sections=64),
        trimesh.creation.box((1, 2, 3)),
    ],
    ids=["torus", "ring", "box"],
)
def test_the_page_measures_the_same_bend(mesh: trimesh.Trimesh, browser: "Browser") -> None:
    shape = shape_of(mesh)
    vertices = (np.asarray(mesh.vertices, np.float64) - shape.center) / shape.scale
    arguments = [packed(vertices), packed(np.asarray(mesh.faces, np.uint32)), page_facts()["config"]["bend"]]
    with scope(browser, WORKER, f"window.bend = {BEND};") as page:
        bend = page.evaluate("arguments_ => window.bend(arguments_)", arguments)
    assert bend == pytest.approx(bend_of(shape), rel=0.1, abs=0.01)


def test_the_page_chooses_the_same_frequencies(browser: "Browser") -> None:
    page = browser.new_page()
    facts, sizes = json.dumps({"studio": page_facts()}), ((48, 1), (64, 4))
    page.evaluate(
        f"{{ const facts = {facts}; class ModelError extends Error {{}} {script(('settings.js',))}"
        f"window.suited = {SUITED}; }} null;"
    )
    shape = shape_of(trimesh.creation.torus(0.77, 0.23, major_sections=128, minor_sections=64))
    usual = Settings(sizes, settings.omegas(None, sizes), (1, 1, 1))
    chosen, bend = suited_omegas(shape, sizes), bend_of(shape)
    suited, again = page.evaluate("arguments_ => window.suited(arguments_)", [bend, ""])
    assert usual.omegas != chosen
    assert suited[:2] == pytest.approx(chosen)
    assert suited[2:] == [usual.texture_omega()]
    assert again == suited, "a training that goes on keeps its frequencies"
    assert page.evaluate("arguments_ => window.suited(arguments_)", [bend, "5,7"])[0][:2] == [5, 7]
    page.close()
