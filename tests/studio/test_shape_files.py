"""What the studio reads from dropped files, in Chromium, against trimesh and the Python trainer's readers."""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from mplicits.readers.content import Mesh
from mplicits.readers.read import read_shape
from mplicits.readers.tidy import tidy
from support import needs
from support.paths import CASES, DATA
from support.studio_files import Files, Reader, files_at, points_of, shape_reader

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SPOT = DATA / "textured" / "spot.obj"
needs_cases = needs.data(CASES)
RADII = np.array([1.0, 0.7, 0.5])
"""Half axes of the ellipsoid of the cases, whose color is 0.5 + 0.4 (x/a, y/b, z/c)."""
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


@pytest.fixture(scope="module")
def read(browser: "Browser") -> Iterator[Reader]:
    with shape_reader(browser) as reader:
        yield reader


def image_bytes(kind: str = "PNG") -> bytes:
    """A smooth image of 31 x 17 pixels."""
    y, x = np.mgrid[:17, :31]
    pixels = np.stack((8 * x, 15 * y, 255 - 8 * x), axis=2).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, kind)
    return buffer.getvalue()


def textured_ball(kind: str = "obj") -> Any:
    """A ball with texture coordinates beyond [0, 1], and with an image. kind: of the file it is meant for."""
    mesh: Any = trimesh.creation.icosphere(2)
    uv = 1.7 * np.asarray(mesh.vertices)[:, :2] - 0.3
    image = Image.open(io.BytesIO(image_bytes()))
    visual: Any = trimesh.visual
    materials = visual.material
    material = materials.PBRMaterial(baseColorTexture=image) if kind == "glb" else materials.SimpleMaterial(image=image)
    mesh.visual = visual.TextureVisuals(uv=uv, material=material)
    return mesh


def exported(mesh: trimesh.Trimesh, folder: Path, kind: str) -> Path:
    """Write a mesh with its companions."""
    mesh.export(folder / f"a.{kind}")
    return folder / f"a.{kind}"


def bytes_in(mesh: Any, kind: str) -> Files:
    """Return a file of a kind with a mesh."""
    name, _, encoding = kind.partition(" ")
    options = {"encoding": encoding} if name == "ply" and encoding else {}
    data = mesh.export(file_type="stl_ascii" if kind == "stl ascii" else name, **options)
    return {f"a.{name}": data.encode() if isinstance(data, str) else data}


@pytest.mark.parametrize("kind", ["obj", "ply", "ply ascii", "stl", "stl ascii", "glb"])
def test_a_mesh_is_read_as_by_trimesh(kind: str, read: Reader) -> None:
    mesh = trimesh.creation.icosphere(1)
    found = read(bytes_in(mesh, kind))
    assert (len(found["vertices"]), len(found["faces"])) == (len(mesh.vertices), len(mesh.faces))
    np.testing.assert_allclose(found["vertices"][found["faces"]], mesh.triangles, atol=1e-6)


def test_a_glb_of_placed_parts_is_one_mesh(read: Reader) -> None:
    scene: Any = trimesh.Scene()
    placing: Any = trimesh.transformations
    scene.add_geometry(trimesh.creation.icosphere(1), transform=placing.rotation_matrix(0.5, (1, 2, 3), (0.1, 0, 0)))
    scene.add_geometry(trimesh.creation.box(), transform=placing.scale_matrix(2, (1, 0, 0)))
    found = read({"a.GLB": scene.export(file_type="glb")})
    ours, theirs = trimesh.Trimesh(found["vertices"], found["faces"]), scene.to_mesh()
    np.testing.assert_allclose(ours.bounds, theirs.bounds, atol=1e-6)
    assert ours.volume == pytest.approx(theirs.volume, rel=1e-5)


def test_polygons_and_other_properties_are_understood(read: Reader) -> None:
    ply, obj = read({"a.ply": PLY.encode()}), read({"a.obj": OBJ.encode()})
    assert ply["faces"].tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]
    assert ply["vertices"][4].tolist() == [0, 0, 2]
    assert obj["faces"].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_what_is_no_shape_is_refused(read: Reader) -> None:
    assert "not a mesh" in read({"a.step": b""})["refused"]
    assert "without normals" in read({"a.obj": b"v 0 0 0"})["refused"]


def assert_colors_are_python_s(found: dict[str, Any], path: Path) -> None:
    """Compare with the Python trainer's texture at the same places of the same faces."""
    read = read_shape(path)
    assert isinstance(read, Mesh)
    theirs = tidy(read)
    assert theirs.paint is not None
    np.testing.assert_allclose(found["vertices"][found["faces"]], theirs.vertices[theirs.faces], atol=1e-6)
    s, t = found["sampled"][:, :2].T
    weights = np.stack((1 - s - t, s, t), axis=1)[:, :, None]
    colors = theirs.paint.at(np.arange(len(found["faces"])), weights)
    np.testing.assert_allclose(found["sampled"][:, 2:], colors, atol=1e-4)


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_the_colors_of_an_image_are_python_s(kind: str, read: Reader, tmp_path: Path) -> None:
    path = exported(textured_ball(kind), tmp_path, kind)
    found = read(files_at(*sorted(tmp_path.iterdir())))
    assert found["notes"][0] == "320 triangles, texture 31 x 17"
    assert found["up"] == ("y" if kind == "glb" else None)
    assert len(found["vertices"]) == 162
    assert_colors_are_python_s(found, path)


@needs.data(SPOT)
def test_the_colors_of_spot_are_python_s(read: Reader) -> None:
    found = read(files_at(SPOT, SPOT.with_suffix(".mtl"), SPOT.with_name("spot_texture.png")))
    assert found["notes"] == ["5,856 triangles, texture 1024 x 1024"]
    assert_colors_are_python_s(found, SPOT)


@pytest.mark.parametrize("kind", ["obj", "ply", "ply ascii", "glb"])
def test_the_colors_of_vertices_are_trimesh_s(kind: str, read: Reader, tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(1)
    rgb = np.random.default_rng(0).uniform(0, 1, (42, 3))
    mesh.visual.vertex_colors = np.round(255 * rgb).astype(np.uint8)
    found = read(bytes_in(mesh, kind))
    assert found["notes"][0] == "80 triangles, colors of vertices"
    s, t = found["sampled"][:, :2].T
    weights = np.stack((1 - s - t, s, t), axis=1)[:, :, None]
    at_corners = np.asarray(mesh.visual.vertex_colors)[mesh.faces][:, :, :3] / 255
    if kind == "glb":  # trimesh writes sRGB where the format wants linear light
        at_corners = np.where(at_corners < 0.0031308, 12.92 * at_corners, 1.055 * at_corners ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(found["sampled"][:, 2:], (at_corners * weights).sum(1), atol=1e-3)


@needs_cases
@pytest.mark.parametrize(
    "names",
    [
        *(["g_color_u16.glb"], ["g_color_linear_float.glb"], ["g_color_u8_material.glb"], ["g_texture_transform.glb"]),
        *(["o_vertex_colours_and_uv.obj"], ["p_st_colours.ply"], ["p_face_colours.ply"]),
        *([f"o_{kind}.obj", f"m_{kind}.mtl", "tex.png"] for kind in ("ok", "backslash", "options", "latin1")),
        *(["o_map_Ka.obj", "m_ka.mtl", "tex.png"], ["o_missing_mtl.obj", "tex.png"], ["p_st.ply", "tex.png"]),
        ["p_wedge_missing.ply", "tex.png"],
    ],
    ids=lambda names: names[0],
)
def test_a_case_has_its_true_colors(names: list[str], read: Reader) -> None:
    found = read(files_at(*(CASES / name for name in names)))
    truth = 0.5 + 0.4 * points_of(found) / RADII
    error = np.abs(found["sampled"][:, 2:] - truth)
    assert np.quantile(error, 0.97) < 0.04  # coarse texels at the poles, and colors of whole faces


@needs_cases
def test_factors_multiply_linear_light(read: Reader) -> None:
    plain, dark = (read(files_at(CASES / name)) for name in ("g_texture_transform.glb", "g_tex_factor.glb"))
    assert dark["sampled"][:, 2:].max() < 0.5 < plain["sampled"][:, 2:].max()
    truth = 0.5 + 0.4 * points_of(dark) / RADII
    linear = 0.2 * np.where(truth < 0.04045, truth / 12.92, ((truth + 0.055) / 1.055) ** 2.4)
    dimmed = 1.055 * linear ** (1 / 2.4) - 0.055
    assert np.quantile(np.abs(dark["sampled"][:, 2:] - dimmed), 0.97) < 0.03
    red = read(files_at(CASES / "o_kd_no_uv.obj", CASES / "m_kd.mtl"))
    np.testing.assert_allclose(red["sampled"][:, 2:], np.tile([0.8, 0.2, 0.1], (1840, 1)))


@needs_cases
@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("o_no_mtl.obj", "texture coordinates, but no image; drop it together with the mesh"),
        ("o_missing_mtl.obj", "the materials not_there.mtl are missing"),
        ("p_wedge_missing.ply", "the image gone.png is missing; gray instead"),
        ("g_ktx2.glb", "the image texture (0) is not a PNG, JPEG or WebP; gray instead"),
    ],
)
def test_what_is_missing_is_said(name: str, note: str, read: Reader) -> None:
    found = read(files_at(CASES / name))
    assert note in found["notes"]
    assert "sampled" not in found


@needs_cases
@pytest.mark.parametrize("name", ["g_skin.glb", "g_sparse.glb", "g_quantised_two_parts.glb", "g_instances.glb"])
def test_parts_of_a_glb_are_in_their_places(name: str, read: Reader) -> None:
    found = read(files_at(CASES / name))
    volume = trimesh.Trimesh(found["vertices"], found["faces"], process=False).volume
    low, high = found["vertices"].min(axis=0), found["vertices"].max(axis=0)
    size = high - low
    ellipsoid = 4 / 3 * np.pi * RADII.prod()
    if name in {"g_skin.glb", "g_sparse.glb"}:
        np.testing.assert_allclose(size, 2 * RADII, atol=0.01)
        assert volume == pytest.approx(ellipsoid, rel=0.03)
    elif name == "g_quantised_two_parts.glb":
        np.testing.assert_allclose(size, (5.5, 1.4, 1.0), atol=0.01)
        assert volume == pytest.approx(ellipsoid * 1.125, rel=0.03)
    else:
        np.testing.assert_allclose(size, (6, 1.4, 1.0), atol=0.01)
        assert volume == pytest.approx(3 * ellipsoid, rel=0.03)
    np.testing.assert_allclose((low + high)[1:], 0, atol=0.01)


@needs_cases
@pytest.mark.parametrize("name", ["mixed_binary.ply", "cr_line_ends.ply", "s_tail.stl", "o_comments.obj"])
def test_odd_but_right_files_are_read(name: str, read: Reader) -> None:
    found = read(files_at(CASES / name))
    mesh = trimesh.Trimesh(found["vertices"], found["faces"], process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0


@needs_cases
def test_concave_polygons_are_cut_into_ears(read: Reader) -> None:
    found = read(files_at(CASES / "n_ell.obj"))
    mesh = trimesh.Trimesh(found["vertices"], found["faces"], process=False)
    assert mesh.is_watertight
    assert mesh.area == pytest.approx(2 * 5 + 12)  # an L of area 5 and perimeter 12, one thick


@pytest.mark.parametrize("seed", range(8))
def test_a_random_star_keeps_its_area(seed: int, read: Reader) -> None:
    """A star-shaped polygon in a tilted plane: its triangles cover it once."""
    random = np.random.default_rng(seed)
    angle = np.sort(random.uniform(0, 2 * np.pi, 40))
    ring = random.uniform(0.2, 1, 40)[:, None] * np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=1)
    following = np.roll(ring, -1, axis=0)
    area = (ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]).sum() / 2
    tilted = ring @ np.linalg.qr(random.normal(size=(3, 3)))[0]
    lines = [f"v {x} {y} {z}" for x, y, z in tilted] + ["f " + " ".join(str(k) for k in range(1, 41))]
    found = read({"star.obj": "\n".join(lines).encode()})
    assert len(found["faces"]) == 38
    assert trimesh.Trimesh(found["vertices"], found["faces"], process=False).area == pytest.approx(area, rel=1e-6)


@needs_cases
@pytest.mark.parametrize(
    ("name", "points", "colored"),
    [
        *(("c_float_colours.ply", 3000, True), ("c_diffuse.ply", 3000, True), ("c_normal_x.ply", 3000, True)),
        *(("c_nan_some.ply", 2940, True), ("c_zero_normals_some.ply", 2940, True), ("x_nan_rows.xyz", 1500, False)),
        *(("x_csv.xyz", 1500, False), ("x_header.xyz", 1500, False), ("x_bom.xyz", 1500, False)),
        *(("x_rgb_then_normals.xyz", 1500, True), ("c_inward_normals.ply", 3000, True)),
    ],
)
def test_a_cloud_of_the_cases_is_read(name: str, points: int, colored: bool, read: Reader) -> None:
    found = read(files_at(CASES / name))
    assert len(found["vertices"]) == points
    assert len(found["faces"]) == 0
    directions = found["vertices"] / np.linalg.norm(found["vertices"], axis=1, keepdims=True)
    assert (found["normals"] * directions).sum(1).min() > 0.7  # a ball or an ellipsoid
    np.testing.assert_allclose(np.linalg.norm(found["normals"], axis=1), 1)
    assert ("colors" in found) == colored
    if colored:
        assert np.corrcoef(found["colors"].ravel(), found["vertices"].ravel())[0, 1] > 0.8


def test_a_cloud_without_normals_names_the_command_line(read: Reader) -> None:
    points = trimesh.creation.icosphere(2).vertices
    text = "\n".join(" ".join(f"{c:.5f}" for c in point) for point in points).encode()
    message = "a point cloud without normals; train it with: mplicits train bare.xyz"
    assert read({"bare.xyz": text}) == {"refused": message}
    cloud: Any = trimesh.PointCloud
    ply = cloud(points).export(file_type="ply")
    assert read({"bare.ply": ply})["refused"].startswith("a point cloud without normals")


def test_points_at_one_place_are_one(read: Reader) -> None:
    rows = np.tile(trimesh.creation.icosphere(2).vertices, (2, 1))
    table = np.hstack((rows, rows, np.tile([[255, 0, 0], [0, 0, 255]], (1, 162)).reshape(-1, 3)))
    found = read({"twice.xyz": "\n".join(" ".join(map(str, row)) for row in table).encode()})
    assert len(found["vertices"]) == 162
    np.testing.assert_allclose(found["normals"], rows[:162], atol=1e-9)
    assert found["colors"].sum(axis=1) == pytest.approx(1)


def test_the_largest_shape_of_a_folder_is_taken(read: Reader) -> None:
    small, large = (trimesh.creation.icosphere(k).export(file_type="stl") for k in (1, 2))
    found = read({"all/a.stl": small, "all/more/b.stl": large, "all/readme.txt": b""})
    assert (found["name"], len(found["faces"])) == ("b.stl", 320)
    assert "2 shapes; b.stl is the largest" in found["notes"]


def test_companions_are_found_by_their_paths(read: Reader, tmp_path: Path) -> None:
    exported(textured_ball(), tmp_path, "obj")
    files = files_at(*sorted(tmp_path.iterdir()))
    mtl = next(data for name, data in files.items() if name.endswith(".mtl")).decode()
    image = next(line.split()[1] for line in mtl.splitlines() if line.startswith("map_Kd"))
    mtl = mtl.replace(f"map_Kd {image}", "map_Kd -o 0 0 -s 1 1 1 -clamp on ..\\Maps\\THE Ball.png")
    moved = {"x/a.obj": files["a.obj"], "x/material.mtl": mtl.encode(), "x/maps/the ball.PNG": files[image]}
    found = read({**moved, "x/other/the ball.png": b"no image"})
    assert_colors_are_python_s(found, tmp_path / "a.obj")
    broken = read({**moved, "x/maps/the ball.PNG": b"\x89PNG no image at all, but long enough"})
    assert any("Ball.png" in note and note.endswith("instead") for note in broken["notes"])


def test_a_gltf_with_its_files_is_a_glb(read: Reader) -> None:
    mesh = trimesh.creation.icosphere(1)
    scene: Any = trimesh.Scene(mesh)
    files = scene.export(file_type="gltf")
    found = read({f"box/{name}": data for name, data in files.items()})
    np.testing.assert_allclose(found["vertices"][found["faces"]], mesh.triangles, atol=1e-6)
    assert "missing" in read({"model.gltf": files["model.gltf"]})["refused"]


@pytest.mark.parametrize("extension", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "A\nB"])
def test_an_unknown_extension_is_refused_by_name(extension: str, read: Reader) -> None:
    text = json.dumps({"asset": {"version": "2.0"}, "extensionsRequired": [extension]}).encode()
    shown = extension.replace("\n", "?")
    assert read({"a.gltf": text})["refused"] == f"it needs the extension {shown}; export it without compression"


def test_a_large_image_is_refused_before_it_is_decoded(read: Reader, tmp_path: Path) -> None:
    exported(textured_ball(), tmp_path, "obj")
    files = files_at(*sorted(tmp_path.iterdir()))
    image = next(name for name in files if name.endswith(".png"))
    header = bytearray(files[image])
    header[16:24] = (30_000).to_bytes(4, "big") * 2
    notes = read({**files, image: bytes(header)})["notes"]
    assert any("has 30000 x 30000 pixels; the limit is 100 million" in note for note in notes)
