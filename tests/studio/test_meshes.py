"""The studio's readers of mesh files in Chromium, against trimesh; and damaged files."""

import base64
from collections.abc import Callable, Iterator
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.web.bundle import modules, script
from support.fuzzing import damaged

if TYPE_CHECKING:
    from playwright.sync_api import Browser

READ = """async ([name, text]) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
    try {
        const {vertices, faces} = await readShape([{name, path: name, bytes}]);
        return {vertices: [...vertices], faces: [...faces]};
    } catch (error) {
        if (error instanceof MeshError) return {refused: error.message};
        throw error;
    }
}"""
MESH = trimesh.creation.icosphere(1)
PLY = """ply
format ascii 1.0
comment a quad and a triangle
element vertex 5
property float32 x
property uchar red
property double z
property float y
element face 2
property list uint8 int vertex_index
property int flags
end_header
0 255 0 0
1 255 0 0
1 255 0 1
0 255 0 1
0 255 2 0
4 0 1 2 3 7
3 0 1 4 7
"""
OBJ = """v 0 0 0
v 1 0 0 # a comment
v\t1 1 0
v 0 1 0
vt 0 0
f 1/1 2/1/1 \\
  3//1 -1
"""
Read = Callable[[str, bytes], dict[str, list[float] | str]]


@pytest.fixture(scope="module")
def read(browser: "Browser") -> Iterator[Read]:
    page = browser.new_page()
    page.evaluate(f"{script(modules('load_shape.js'))} window.read = {READ}; null;")
    yield lambda name, data: page.evaluate("asked => window.read(asked)", [name, base64.b64encode(data).decode()])
    page.close()


def exported(kind: str) -> bytes:
    """Return the bytes of MESH in a file of a kind."""
    name, _, encoding = kind.partition(" ")
    options = {"encoding": encoding} if name == "ply" and encoding else {}
    data = MESH.export(file_type="stl_ascii" if kind == "stl ascii" else name, **options)
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize("kind", ["obj", "ply", "ply ascii", "stl", "stl ascii", "glb"])
def test_a_mesh_is_read_as_by_trimesh(kind: str, read: Read) -> None:
    found = read(f"a.{kind.split(maxsplit=1)[0]}", exported(kind))
    vertices, faces = np.reshape(found["vertices"], (-1, 3)), np.reshape(found["faces"], (-1, 3)).astype(int)
    assert (len(vertices), len(faces)) == (len(MESH.vertices), len(MESH.faces))
    np.testing.assert_allclose(vertices[faces], MESH.triangles, atol=1e-6)


def test_a_glb_of_placed_parts_is_one_mesh(read: Read) -> None:
    scene: Any = trimesh.Scene()
    placing: Any = trimesh.transformations
    scene.add_geometry(MESH, transform=placing.rotation_matrix(0.5, (1, 2, 3), (0.1, 0, 0)))
    scene.add_geometry(trimesh.creation.box(), transform=placing.scale_matrix(2, (1, 0, 0)))
    found = read("a.GLB", scene.export(file_type="glb"))
    ours = trimesh.Trimesh(np.reshape(found["vertices"], (-1, 3)), np.reshape(found["faces"], (-1, 3)).astype(int))
    theirs = scene.to_mesh()
    np.testing.assert_allclose(ours.bounds, theirs.bounds, atol=1e-6)
    assert ours.volume == pytest.approx(theirs.volume, rel=1e-5)


def test_polygons_and_other_properties_are_understood(read: Read) -> None:
    ply, obj = read("a.ply", PLY.encode()), read("a.obj", OBJ.encode())
    assert ply["faces"] == [0, 1, 2, 0, 2, 3, 0, 1, 4]
    assert np.reshape(ply["vertices"], (-1, 3))[4].tolist() == [0, 0, 2]
    assert obj["faces"] == [0, 1, 2, 0, 2, 3]


def test_damaged_files_end_in_one_line(read: Read) -> None:
    random = Random(0)
    for kind in ("obj", "ply", "ply ascii", "stl", "stl ascii", "glb"):
        whole = exported(kind)
        for _ in range(60):
            found = read(f"a.{kind.split()[0]}", damaged(whole, random))
            if "refused" in found:
                assert "\n" not in str(found["refused"])
    assert "not a mesh" in read("a.step", b"")["refused"]
    assert "without normals" in read("a.obj", b"v 0 0 0")["refused"]
