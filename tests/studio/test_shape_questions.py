"""What the studio asks of a mesh, in Chromium, against the Python trainer's shape with flat faces."""

import base64
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import igl
import numpy as np
import pytest
import trimesh
from PIL import Image

from mplicits.model.errors import UserError
from mplicits.readers.content import Mesh
from mplicits.readers.from_trimesh import of_mesh
from mplicits.readers.read import read_shape
from mplicits.readers.tidy import tidy
from mplicits.trainer.shapes.mesh import MeshShape
from support import needs
from support.page_scripts import WORKER, packed, scope, unpacked
from support.paths import DATA

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

MESHES = sorted((*DATA.glob("meshes/*.ply"), *DATA.glob("thingi32/*.ply"), *DATA.glob("textured/*.obj")))
SMALL = DATA / "meshes/xyzrgb_dragon.ply"
WRONG = 1e-4
"""Largest share of signs that are wrong, where the winding number of an open mesh is about 1/2."""
FUNCTIONS = """
// Returns what input() finds, or the message of a MeshError of it or of the shape.
window.understood = async (name, text) => {
    try {
        const {vertices, faces, colors, notes} = await input([{name, path: name, bytes: bytesOf(text)}], 0);
        window.shape = new Shape(vertices, faces, colors);
        const uv = colors?.uv && textOf(colors.uv);
        return {vertices: textOf(vertices), faces: textOf(faces), uv, notes: notes.slice(1)};
    } catch (error) {
        if (error instanceof MeshError) return {refused: error.message};
        throw error;
    }
};
window.distances = (text) => {
    const p = new Float64Array(bytesOf(text)), found = new Float64Array(p.length / 3);
    for (let i = 0; i < found.length; ++i) found[i] = shape.distance(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
    return textOf(found);
};
window.distancesOfRows = (text) => {
    const rows = new Float32Array(bytesOf(text));
    shape.setDistances(rows);
    return textOf(rows);
};
"""


@pytest.fixture(scope="module")
def page(browser: "Browser") -> Iterator["Page"]:
    with scope(browser, WORKER, FUNCTIONS) as page:
        yield page


def understood(page: "Page", name: str, data: bytes) -> dict[str, Any]:
    """Return what the page finds in a file: vertices, faces, uv, notes; or `refused`. It becomes the page's shape."""
    text = base64.b64encode(data).decode()
    found: dict[str, Any] = page.evaluate("([name, text]) => understood(name, text)", [name, text])
    for key, kind in (("vertices", "f8"), ("faces", "u4"), ("uv", "f4")):
        if found.get(key):
            found[key] = unpacked(found[key], kind).reshape(-1, 2 if key == "uv" else 3)
    return found


def ball() -> Any:
    return trimesh.creation.icosphere(2)


def inside_out(mesh: Any) -> Any:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def without_faces(mesh: Any, count: int) -> Any:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[count:], process=False)


def with_fin(mesh: Any) -> Any:
    """Add a face, the third one at an edge."""
    a, b, c = mesh.faces[0]
    return trimesh.Trimesh([*mesh.vertices, mesh.vertices[c] * 1.5], [*mesh.faces, (a, b, len(mesh.vertices))])


SHAPES = {
    "ball": ball(),
    "inside out": inside_out(ball()),
    "a hole": without_faces(ball(), 1),
    "inside out, with a hole": inside_out(without_faces(ball(), 1)),
    "a fin": with_fin(ball()),
    "a cavity": trimesh.util.concatenate([ball(), inside_out(ball().apply_scale(0.5))]),
    "faces of both sides": trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2), (2, 1, 0)], process=False),
    "a square": trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)]),
    "a needle": trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], process=False),
}


@pytest.mark.parametrize("name", SHAPES)
def test_faces_point_outwards_as_in_python(name: str, page: "Page") -> None:
    mesh = SHAPES[name]
    try:
        theirs = MeshShape(tidy(of_mesh(mesh)), "a.ply", {}, crease=None)
    except UserError as error:
        refused = str(error).removeprefix("a.ply: ").partition(";")[0]
        assert understood(page, "a.ply", mesh.export(file_type="ply"))["refused"].startswith(refused)
        return
    ours = understood(page, "a.ply", mesh.export(file_type="ply"))
    assert ours["notes"] == [line.removeprefix("a.ply: ") for line in theirs.warnings]
    corners = theirs._facets.vertices[theirs._facets.faces]
    np.testing.assert_allclose(ours["vertices"][ours["faces"]], corners, atol=1e-6)


def test_texture_coordinates_stay_at_their_corners(page: "Page") -> None:
    mesh: Any = inside_out(ball())
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(baseColorTexture=Image.new("RGB", (2, 2)))
    mesh.visual = visual.TextureVisuals(uv=mesh.vertices[:, :2], material=material)
    ours = understood(page, "a.glb", mesh.export(file_type="glb"))
    assert ours["notes"] == ["the faces point inwards; reversed"]
    np.testing.assert_allclose(ours["uv"], ours["vertices"][ours["faces"].ravel(), :2], atol=1e-5)


def assert_distances_are_python_s(page: "Page", path: Path, count: int) -> None:
    content = read_shape(path)
    assert isinstance(content, Mesh)
    theirs = MeshShape(tidy(content), path.name, {}, crease=None)
    ours = understood(page, path.name, path.read_bytes())
    notes = [note for note in ours["notes"] if not re.search("material|texture", note)]  # it is read without companions
    assert notes == [line.removeprefix(f"{path.name}: ") for line in theirs.warnings]
    random = np.random.default_rng(3)
    points = random.normal(size=(count, 3))
    points *= 1.1 * random.random((count, 1)) ** (1 / 3) / np.linalg.norm(points, axis=1, keepdims=True)
    near = theirs.surface(count // 2, random).points
    points[: count // 2] = near + random.normal(size=near.shape) * 10 ** random.uniform(-5, -1.5, (count // 2, 1))
    found = unpacked(page.evaluate("text => distances(text)", packed(points)), "f8")
    unsigned = theirs._unsigned._exact(points)
    np.testing.assert_allclose(np.abs(found), unsigned, atol=1e-9)
    differ = np.flatnonzero(((found < 0) != (theirs._winding.winding_number(points) > 0.5)) & (unsigned > 1e-6))
    facets = theirs._facets
    exact = (
        np.asarray(igl.winding_number(facets.vertices, facets.faces, points[differ])) if len(differ) else np.empty(0)
    )
    wrong = np.count_nonzero((found[differ] < 0) != (exact > 0.5))
    print(f"{path.name}: {len(facets.faces)} faces, {len(differ)} signs differ from Python's, {wrong} are wrong")
    assert wrong <= WRONG * count
    assert np.all(np.abs(exact - 0.5) < 0.02)


@needs.data(SMALL)
def test_signed_distances_are_python_s(page: "Page") -> None:
    assert_distances_are_python_s(page, SMALL, 20_000)


@pytest.mark.slow
@pytest.mark.parametrize("path", MESHES[::5], ids=lambda path: path.stem)
def test_signed_distances_of_any_mesh_are_python_s(path: Path, page: "Page") -> None:
    assert_distances_are_python_s(page, path, 200_000)


def test_samples_get_the_distances_of_their_places_in_any_order(page: "Page") -> None:
    understood(page, "a.ply", ball().export(file_type="ply"))
    rows = np.random.default_rng(0).uniform(-1.3, 1.3, (3000, 12)).astype(np.float32)
    found = unpacked(page.evaluate("text => distancesOfRows(text)", packed(rows)), "f4").reshape(-1, 12)
    expected = rows.copy()
    expected[:, 8] = unpacked(page.evaluate("text => distances(text)", packed(rows[:, :3].astype(np.float64))), "f8")
    np.testing.assert_array_equal(found, expected)
