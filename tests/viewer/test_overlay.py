"""A mesh over the picture of its model: the place of its edges, its faces, and errors."""

from pathlib import Path

import numpy as np
import pytest

from mplicits import glsl
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.mesh_program import clip_planes
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.rasterizer import Rasterizer
from mplicits.viewer.draw.triangles import read_triangles
from mplicits.viewer.state.overlay import MeshSource, Overlay
from support import needs
from support.viewer_fixture import AREA, OpenViewer, picture_of, settle

CUBE = """v -.5 -.5 -.5\nv .5 -.5 -.5\nv .5 .5 -.5\nv -.5 .5 -.5\nv -.5 -.5 .5\nv .5 -.5 .5\nv .5 .5 .5\nv -.5 .5 .5
f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 4 7 3\nf 4 8 7\nf 1 5 8\nf 1 8 4\nf 2 3 7\nf 2 7 6\n"""


@pytest.fixture
def cube(tmp_path: Path) -> MeshSource:
    """A cube in model space."""
    needs.package("trimesh")
    (tmp_path / "cube.obj").write_text(CUBE)
    return MeshSource(tmp_path / "cube.obj", "model")


def test_visible_edges_lie_where_the_mesh_has_them(open_viewer: OpenViewer, cube: MeshSource) -> None:
    viewer = open_viewer()
    size, camera = (200, 200), Camera(0, 0, 3.0)
    plain = viewer.renderer.render(size, camera)
    overlay = Overlay(viewer.context, cube, "auto")
    edged = overlay.renderer_for(viewer.renderer, viewer.source, "edges").render(size, camera)
    overlay.renderer_for(viewer.renderer, viewer.source, "hidden")
    np.testing.assert_array_equal(edged[..., 3], plain[..., 3])
    changed = np.abs(edged - plain).max(axis=-1) > 0.02
    rows, columns = np.nonzero(changed)
    near = camera.focal * 100 / (3.0 - 0.5) * 0.5
    far = camera.focal * 100 / (3.0 + 0.5) * 0.5
    assert abs(columns.min() - (100 - near)) < 2, "the front face's border, from the projection by hand"
    assert abs(columns.max() - (100 + near)) < 2
    inside = (abs(rows - 99.5) < near - 3) & (abs(columns - 99.5) < near - 3)
    diagonal = abs(abs(rows - 99.5) - abs(columns - 99.5)) < 2
    assert diagonal[inside].all(), "all that is seen inside the front face is its diagonal; the back face is hidden"
    assert inside.sum() > near
    assert far < near - 10
    np.testing.assert_array_equal(viewer.renderer.render(size, camera), plain)
    overlay.release()


def test_faces_match_render(open_viewer: OpenViewer, cube: MeshSource) -> None:
    viewer = open_viewer()
    viewer.overlay = Overlay(viewer.context, cube, "auto")
    settle(viewer)
    traced = picture_of(viewer)
    viewer.view.key("M")
    viewer.view.key("M")
    settle(viewer)
    assert viewer.source.model is not None
    triangles = read_triangles(cube.path, (0.0, 0.0, 0.0), 1.0)
    rasterizer = Rasterizer(viewer.context, viewer.source.model, triangles)
    rendered = rasterizer.render(AREA, viewer.view.camera, RenderOptions())[..., :3]
    rasterizer.release()
    assert np.abs(rendered - traced).max() > 0.1
    np.testing.assert_allclose(picture_of(viewer), rendered, atol=2e-5)
    viewer.view.change(split=1)
    settle(viewer)
    half = picture_of(viewer)
    np.testing.assert_allclose(half[:, :12], rendered[:, :12], atol=2e-5)
    assert np.abs(half[:, 12:] - rendered[:, 12:]).max() > 0.05, "the right half wears the normals of level 1"


def test_a_broken_mesh_is_reported(open_viewer: OpenViewer, tmp_path: Path) -> None:
    needs.package("trimesh")
    (tmp_path / "bad.ply").write_bytes(b"ply\nnothing")
    viewer = open_viewer()
    viewer.overlay = Overlay(viewer.context, MeshSource(tmp_path / "bad.ply"), "auto")
    viewer.view.key("M")
    settle(viewer, lambda: "bad.ply" in viewer.message)
    assert viewer.view.mesh == "hidden"


@pytest.mark.parametrize(
    ("name", "right", "mode"),
    [
        ("mesh.glsl", "vec3 eye = ", "faces"),
        ("mesh_background.glsl", "vec2 pixel = ", "faces"),
        ("mesh.vert.glsl", "vec3 view = ", "edges"),
        ("background.glsl", "return ", "faces"),
    ],
)
def test_an_error_in_the_glsl_of_a_mesh_names_its_file_and_line(
    open_viewer: OpenViewer,
    cube: MeshSource,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    right: str,
    mode: str,
) -> None:
    viewer, read = open_viewer(), glsl.read
    viewer.overlay = Overlay(viewer.context, cube, "auto")
    lines = read(name).splitlines()
    line = next(k for k, text in enumerate(lines, start=1) if right in text)
    wrong = "\n".join([*lines[: line - 1], lines[line - 1].replace(right, right + "steeps + "), *lines[line:], ""])
    monkeypatch.setattr(glsl, "read", lambda file: wrong if file == name else read(file))
    viewer.view.change(mesh=mode)
    settle(viewer, lambda: bool(viewer.log))
    assert f"{name}:{line}" in viewer.log[0]
    assert "steeps" in viewer.log[0].partition("; ")[2], "the line itself"
    assert viewer.view.mesh == "hidden"
    if mode == "edges":
        monkeypatch.setattr(glsl, "read", read)
        viewer.view.change(mesh=mode)
        settle(viewer)
        assert viewer.view.mesh == mode, "the file is read again, the broken text is not kept"


def test_the_clip_planes_enclose_the_mesh_wherever_the_camera_looks() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    for azimuth, right, up in ((0, 0.0, 0.0), (50, 0.7, 0.4), (200, -3.0, 2.0)):
        camera = Camera(azimuth, 20, 3.5).panned(right, up)
        matrix = camera.matrix().astype(float)
        depth = -(points - matrix[:3, 3]) @ matrix[:3, 2]
        near, far = clip_planes(camera, 1.0)
        assert near <= depth.min()
        assert depth.max() <= far
