"""The curved surface that the studio makes of a mesh, in Chromium, against the Python trainer's."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh import MeshShape
from support import needs
from support.page_scripts import WORKER, scope, unpacked
from support.paths import DATA
from support.studio_files import files_at
from support.studio_files import packed as packed_files

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SPOT = DATA / "textured" / "spot.obj"
FACETS = """
// Returns the facets that the page makes of files, and samples of them: the facet of each, a row, a color. places: in
// [0, 1), of the samples in the list of facets; weights: barycentric.
window.curvedOf = async (files, crease, places, weights) => {
    const given = files.map(([name, text]) => ({name, path: name, bytes: bytesOf(text)}));
    const {read} = withFacets(await input(given), crease), {vertices, faces, normals, normalOf} = read.facets;
    const shape = new Shape(read.vertices, read.faces, read.colors, read.facets);
    const rows = new Float32Array(SAMPLE * weights.length), colors = new Float64Array(3 * weights.length);
    const facets = weights.map((_, i) => Math.floor(places[i] * faces.length / 3));
    facets.forEach((facet, i) => {
        shape.place(facet, weights[i], rows, SAMPLE * i);
        if (read.colors) shape.color(facet, weights[i], colors, 3 * i);
    });
    const arrays = {vertices, faces, normals, normalOf, rows, colors, facets: Uint32Array.from(facets)};
    const texts = Object.entries(arrays).map(([key, array]) => [key, textOf(array)]);
    return {center: read.center, scale: read.scale, ...Object.fromEntries(texts)};
};
"""
KINDS = {"vertices": "f8", "normals": "f4", "rows": "f4", "colors": "f8"}
"""Types of what curvedOf returns; the others are u4."""
PLACES = 2000


@pytest.fixture(scope="module")
def page(browser: "Browser") -> Iterator["Page"]:
    with scope(browser, WORKER, FACETS) as page:
        yield page


def curved(page: "Page", files: Mapping[str, bytes], crease: float | None = CREASE) -> dict[str, Any]:
    """Return what the page makes of files, and asks of it at PLACES random places."""
    random = np.random.default_rng(0)
    places, weights = random.random(PLACES), random.dirichlet((1, 1, 1), PLACES)
    found: dict[str, Any] = page.evaluate(
        "arguments_ => curvedOf(...arguments_)", [packed_files(files), crease, places.tolist(), weights.tolist()]
    )
    for key, text in found.items():
        if isinstance(text, str):
            found[key] = unpacked(text, KINDS.get(key, "u4"))
            if key != "facets":
                found[key] = found[key].reshape(-1, 12 if key == "rows" else 3)
    return found | {"weights": weights}


def assert_facets_are_python_s(page: "Page", path: Path, crease: float | None = CREASE) -> MeshShape:
    found = curved(page, files_at(*sorted(path.parent.glob(f"{path.stem}*"))), crease)
    theirs, _ = load_shape(path, crease=crease)
    assert isinstance(theirs, MeshShape)
    facets = theirs._facets
    np.testing.assert_allclose(found["center"], theirs.center, atol=1e-6)
    assert found["scale"] == pytest.approx(theirs.scale, rel=1e-6)
    np.testing.assert_allclose(found["vertices"][found["faces"]], facets.vertices[facets.faces], atol=1e-6)
    np.testing.assert_allclose(found["normals"][found["normalOf"]], facets.normals[:], atol=1e-6)
    where, weights = found["facets"], found["weights"][:, :, None]
    points = (facets.vertices[facets.faces[where]] * weights).sum(axis=1)
    normals = (facets.normals[where] * weights).sum(axis=1)
    np.testing.assert_allclose(found["rows"][:, :3], points, atol=1e-6)
    expected = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    np.testing.assert_allclose(found["rows"][:, 9:], expected, atol=1e-6)
    if theirs.colored:
        # Texture coordinates are single-precision numbers in the page.
        colors = np.asarray(theirs._colors_at(where, weights))
        np.testing.assert_allclose(found["colors"], colors, atol=1e-5)
    return theirs


def ball(subdivisions: int = 2) -> Any:
    return trimesh.creation.icosphere(subdivisions)


def moved(mesh: Any, far: float) -> Any:
    """Move vertices at random, so that edges bend by any angle."""
    vertices = mesh.vertices + np.random.default_rng(0).normal(scale=far, size=mesh.vertices.shape)
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def cylinder(sides: int) -> Any:
    mesh = trimesh.creation.cylinder(1.0, 2.0, sections=sides)
    mesh.merge_vertices()
    return mesh


def colored(mesh: Any) -> Any:
    rgb = np.random.default_rng(0).integers(0, 256, (len(mesh.vertices), 3))
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=rgb.astype(np.uint8), process=False)


def with_fin(mesh: Any) -> Any:
    """Add a face, the third one at an edge."""
    a, b, c = mesh.faces[0]
    return trimesh.Trimesh([*mesh.vertices, mesh.vertices[c] * 1.5], [*mesh.faces, (a, b, len(mesh.vertices))])


SHAPES = {
    "a cube": trimesh.creation.box((1, 2, 3)),
    "a coarse ball": ball(1),
    "a colored ball": colored(ball()),
    "an open ball": trimesh.Trimesh(ball().vertices, ball().faces[7:]),
    "a ball inside out": trimesh.Trimesh(ball().vertices, ball().faces[:, ::-1], process=False),
    "a ball with a fin": with_fin(ball()),
    "a rough ball": moved(ball(), 0.03),
    "a prism": cylinder(5),
    "a coarse cylinder": cylinder(9),
    "two parts": trimesh.util.concatenate([ball(1), trimesh.creation.box().apply_translation((3, 0, 0))]),
}


@pytest.mark.parametrize("name", SHAPES)
def test_the_facets_are_python_s(name: str, page: "Page", tmp_path: Path) -> None:
    SHAPES[name].export(tmp_path / "a.ply")
    assert_facets_are_python_s(page, tmp_path / "a.ply")


@pytest.mark.parametrize("crease", [0.0, 15.0, 70.0, None])
def test_the_crease_may_be_chosen(crease: float | None, page: "Page", tmp_path: Path) -> None:
    SHAPES["a rough ball"].export(tmp_path / "a.ply")
    assert_facets_are_python_s(page, tmp_path / "a.ply", crease)


@pytest.mark.parametrize("kind", ["ply", "obj", "glb"])
def test_the_normals_of_a_file_take_precedence_where_they_fit(kind: str, page: "Page", tmp_path: Path) -> None:
    mesh: Any = ball(1)
    normals = mesh.vertex_normals + np.random.default_rng(0).normal(scale=0.2, size=mesh.vertices.shape)
    normals[:5] *= -1
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_normals=2 * normals, process=False)
    placing: Any = trimesh.transformations
    turned = placing.scale_matrix(-2, None, (1, 0, 0)) @ placing.rotation_matrix(0.5, (1, 2, 3), (0.1, 0, 0))
    scene: Any = trimesh.Scene()
    scene.add_geometry(mesh, transform=turned)
    path = tmp_path / f"a.{kind}"
    if kind == "glb":
        scene.export(path, include_normals=True)
    else:
        mesh.export(path, **({"vertex_normal": True} if kind == "ply" else {"include_normals": True}))
    theirs = assert_facets_are_python_s(page, path)
    with_own = theirs._facets.normals[:]
    radial = theirs._facets.vertices[theirs._facets.faces]
    radial /= np.linalg.norm(radial, axis=2, keepdims=True)
    assert (radial * with_own).sum(axis=2).min() < 0.98, "the file's normals are not the ball's"


def test_polygons_keep_their_corners_normals(page: "Page", tmp_path: Path) -> None:
    """A concave prism; the normals of its upper side lean."""
    ring = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in ring]
    lines += [f"vn {0.1 * x - 0.1} {0.1 * y} 1" for x, y in ring] + ["vn 0 0 -1"]
    lines += [f"vn {x} {y} 0" for x, y in ((0, -1), (1, 0), (0, 1), (1, 0), (0, 1), (-1, 0))]
    lines += [
        "f " + " ".join(f"{k + 7}//{k + 1}" for k in range(6)),
        "f " + " ".join(f"{k}//7" for k in (4, 3, 2, 1, 6, 5)),
    ]
    for k in range(6):
        near, far = k + 1, (k + 1) % 6 + 1
        lines.append("f " + " ".join(f"{vertex}//{8 + k}" for vertex in (near, far, far + 6, near + 6)))
    (tmp_path / "a.obj").write_text("\n".join(lines))
    theirs = assert_facets_are_python_s(page, tmp_path / "a.obj")
    assert len(np.unique(np.round(theirs._facets.normals[:].reshape(-1, 3), 3), axis=0)) > 20


@pytest.mark.slow
@needs.data(SPOT)
def test_spot_has_python_s_facets_and_colors(page: "Page") -> None:
    assert_facets_are_python_s(page, SPOT)
