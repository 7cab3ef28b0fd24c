"""The studio's examples in Chromium: closed meshes, and the rope is the built-in shape of Python."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.trainer.shapes.demo import DemoShape
from support.page_scripts import scope, unpacked

if TYPE_CHECKING:
    from playwright.sync_api import Browser

MAKE = """() => EXAMPLES.map(({name, make}) => {
    const {vertices, faces, colors} = make();
    return [name, textOf(vertices), textOf(faces), colors && textOf(colors.vertex)];
})"""


@pytest.fixture(scope="module")
def examples(browser: "Browser") -> dict[str, tuple[Any, np.ndarray | None]]:
    """Return name -> (mesh, colors (V, 3) or None)."""
    with scope(browser, ("examples.js",), f"window.make = {MAKE};") as page:
        made = page.evaluate("() => window.make()")
    return {
        name: (
            trimesh.Trimesh(rows(vertices, "f8"), rows(faces, "u4"), process=False),
            None if colors is None else rows(colors, "f4"),
        )
        for name, vertices, faces, colors in made
    }


def rows(text: str, kind: str) -> np.ndarray:
    return unpacked(text, kind).reshape(-1, 3)


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


def test_the_rope_is_the_built_in_shape(examples: dict[str, tuple[Any, np.ndarray | None]]) -> None:
    mesh, colors = examples["rope"]
    assert colors is not None
    vertices = np.array(mesh.vertices) - mesh.bounds.mean(axis=0)
    vertices /= np.linalg.norm(vertices, axis=1).max()
    shape = DemoShape()
    assert np.abs(shape.distance(vertices)).max() < 1e-3
    assert np.abs(colors - shape.colors_near(vertices)).mean() < 0.005
