"""What the studio says of a browser that cannot train, of a file, and of a result that is far from its shape."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import trimesh

from mplicits.model.model_file import to_bytes
from support.browser import visit
from support.random_model import random_model
from support.studio_visit import ball, ready, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser

LACKS = {
    "WebAssembly SIMD": "WebAssembly.validate = () => false;",
    "WebAssembly": "delete globalThis.WebAssembly;",
    "workers": "delete globalThis.Worker;",
}
"""What a browser lacks -> script that takes it away."""
EMPTY = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
BAD = {
    "nothing.ply": (b"", "not a PLY file, or a damaged one"),
    "empty.ply": (EMPTY, "the mesh is empty; a shape needs triangles, or points with normals"),
    "flat.obj": (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "the mesh encloses no volume; use a closed surface, or: mplicits train --thicken T",
    ),
}
"""Name of a file -> its content, and what is wrong."""


@pytest.mark.parametrize("lack", LACKS)
def test_a_browser_that_cannot_train_is_told_before_a_file(lack: str, browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, write_page(tmp_path / "studio.html", 20), share=0.1, script=LACKS[lack]) as visited:
        line = f"This browser has no {lack}, which a training needs. "
        visited.page.wait_for_selector("#lacking:not(:empty)")
        assert visited.page.inner_text("#lacking").startswith(line)
        assert visited.page.locator("#examples button:enabled").count() == 0
        ready(visited)
        visited.drop(ball(), "a.stl")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.message().startswith(f"a.stl: {line}")
        visited.drop(to_bytes(random_model((4, 0), name="other")), "other.safetensors")
        visited.until("document.title === 'other'")
        assert not visited.page.is_visible("#welcome")
        assert visited.console == []


@pytest.mark.slow
def test_a_result_far_from_its_shape_is_called_so(browser: "Browser", tmp_path: Path) -> None:
    """The largest of several files is named where it is wrong; what was read stays visible."""
    with visit(browser, write_page(tmp_path / "studio.html", 3), size=(900, 600), share=0.1) as visited:
        page = visited.page
        ready(visited)
        for name, (data, message) in BAD.items():
            visited.drop(data, name)
            page.wait_for_function(
                "text => document.querySelector('#message p').textContent === text", arg=f"{name}: {message}"
            )
        mesh = trimesh.creation.icosphere(3)
        visited.drop(b"mtllib gone.mtl\n" + mesh.export(file_type="obj").encode(), "a ball.obj")
        page.wait_for_selector("#download")
        assert page.inner_text("#ended").startswith("The shape is not learned yet: off by ")
        assert page.get_attribute("html", "data-far") == ""
        assert page.evaluate("document.getElementById('settings').firstElementChild.id") == "longer"
        assert page.inner_text("#read") == "Read: 1,280 triangles · the materials gone.mtl are missing"
        assert page.is_visible("#read")
        assert visited.console == []
