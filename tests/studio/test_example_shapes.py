"""The studio's examples in Chromium: closed meshes, and the rope is the built-in shape of Python."""

import base64
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.trainer.shapes.demo import DemoShape
from mplicits.web.bundle import script

if TYPE_CHECKING:
    from playwright.sync_api import Browser

MAKE = """async () => {
    const textOf = (array) => new Promise((resolve) => {
        const reader = new FileReader();
        reader.onload = () => resolve(reader.result.split(",")[1]);
        reader.readAsDataURL(new Blob([array]));
    });
    return Promise.all(EXAMPLES.map(async ({name, make}) => {
        const {vertices, faces, colors} = make();
        return [name, await textOf(vertices), await textOf(faces), colors && await textOf(colors.vertex)];
    }));
}"""


@pytest.fixture(scope="module")
def examples(browser: "Browser") -> dict[str, tuple[Any, np.ndarray | None]]:
    """Return name -> (mesh, colors (V, 3) or None)."""
    page = browser.new_page()
    made = page.evaluate(f"() => {{ {script(('examples.js',))} return ({MAKE})(); }}")
    page.close()
    return {
        name: (
            trimesh.Trimesh(rows(vertices, np.float64), rows(faces, np.uint32), process=False),
            None if colors is None else rows(colors, np.float32),
        )
        for name, vertices, faces, colors in made
    }


def rows(text: str, kind: type) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind).reshape(-1, 3)


@pytest.mark.parametrize(("name", "parts", "euler"), [("rope", 61, 118), ("vase", 1, 2), ("gear", 1, 0)])
def test_an_example_is_a_closed_mesh(
    name: str, parts: int, euler: int, examples: dict[str, tuple[Any, np.ndarray | None]]
) -> None:
    mesh, colors = examples[name]
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert (mesh.body_count, mesh.euler_number) == (parts, euler)
    assert all(part.volume > 0 for part in mesh.split())
    assert mesh.area_faces.min() > 1e-6
    assert (colors is None) == (name == "gear")
    if colors is not None:
        assert colors.shape == mesh.vertices.shape
        assert colors.min() >= 0
        assert colors.max() <= 1


def test_the_gear_has_sharp_edges_between_flat_faces(examples: dict[str, tuple[Any, np.ndarray | None]]) -> None:
    mesh, _ = examples["gear"]
    sharp = mesh.face_adjacency_angles > math.radians(40)
    flat = mesh.face_adjacency_angles < 1e-6
    assert sharp.sum() > 700
    assert flat.mean() > 0.3


def test_the_rope_is_the_built_in_shape(examples: dict[str, tuple[Any, np.ndarray | None]]) -> None:
    mesh, colors = examples["rope"]
    assert colors is not None
    vertices = np.array(mesh.vertices) - mesh.bounds.mean(axis=0)
    vertices /= np.linalg.norm(vertices, axis=1).max()
    shape = DemoShape()
    assert np.abs(shape.distance(vertices)).max() < 1e-3
    assert np.abs(colors - shape.colors_near(vertices)).mean() < 0.005
