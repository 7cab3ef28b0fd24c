"""Files that people have and that went wrong: each row of cases/README.md, by its truth."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import mplicits
from mplicits import cli
from mplicits.capture.depth_map import read_depth
from mplicits.capture.folder import read_photographs
from mplicits.capture.pairing import agreement
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.mesher.write import rounding_warning
from mplicits.model.errors import UserError
from mplicits.model.srgb import to_srgb
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from support import needs
from support.ball_training import train
from support.paths import CASES

pytestmark = needs.data(CASES)
RADII = np.array((1.0, 0.7, 0.5))
"""Of the ellipsoid that most files hold, along x, y and z."""
NO_IMAGE = "texture coordinates, but no readable image"


def loaded(name: str, **options: Any) -> tuple[Shape, list[str]]:
    shape, warnings = load_shape(str(CASES / name), **options)
    return shape, [warning.removeprefix(f"{name}: ") for warning in warnings]


def samples(shape: Shape, count: int = 3000) -> tuple[Doubles, Doubles, Doubles | None]:
    """Points of the surface in the file's coordinates, their normals, and their colors."""
    drawn = shape.surface(count, np.random.default_rng(0), colors=True)
    return drawn.points * shape.scale + shape.center, drawn.normals, drawn.colors


def assert_ellipsoid(shape: Shape, tolerance: float = 0.02) -> None:
    """The surface, its normals and the sign inside and outside are the ellipsoid's."""
    points, normals, _ = samples(shape)
    np.testing.assert_allclose(((points / RADII) ** 2).sum(axis=1), 1, atol=tolerance)
    outward = points / RADII**2
    cosine = (normals * outward).sum(axis=1) / np.linalg.norm(outward, axis=1)
    assert np.quantile(cosine, 0.02) > 0.9
    places = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    distance = shape.distance((places - shape.center) / shape.scale)
    inside = ((places / RADII) ** 2).sum(axis=1)
    clear = ~np.isnan(distance) & (np.abs(inside - 1) > 0.1)
    assert clear.mean() > 0.8
    np.testing.assert_array_equal(distance[clear] < 0, inside[clear] < 1)


def assert_colors(shape: Shape, truth: Doubles | None = None, tolerance: float = 0.03) -> None:
    points, _, colors = samples(shape)
    assert colors is not None
    expected = 0.5 + 0.4 * points / RADII if truth is None else np.tile(truth, (len(points), 1))
    assert np.quantile(np.abs(colors - expected), 0.97) < tolerance


ELLIPSOIDS = {
    **dict.fromkeys(("g_color_u16.glb", "g_color_linear_float.glb", "g_color_u8_material.glb"), 0.03),
    **dict.fromkeys(("g_texture_transform.glb", "o_vertex_colours_and_uv.obj", "p_st_colours.ply"), 0.03),
    **dict.fromkeys(("o_ok.obj", "o_backslash.obj", "o_options.obj", "o_map_Ka.obj", "o_latin1.obj"), 0.03),
    "p_face_colours.ply": 0.04,
}


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_a_mesh_has_its_place_and_its_colors(name: str) -> None:
    shape, warnings = loaded(name)
    assert warnings == []
    assert_ellipsoid(shape)
    assert_colors(shape, tolerance=ELLIPSOIDS[name])


CLOUDS = ("c_float_colours.ply", "c_diffuse.ply", "c_normal_x.ply", "n_colors.npz", "x_rgb_then_normals.xyz")


@pytest.mark.parametrize("name", CLOUDS)
def test_a_cloud_has_its_normals_and_its_colors(name: str) -> None:
    shape, warnings = loaded(name)
    assert not [line for line in warnings if "merged" not in line]
    assert_ellipsoid(shape)
    assert_colors(shape)


@pytest.mark.parametrize("name", ["n_xyz.npz", "x_csv.xyz", "x_header.xyz", "x_bom.xyz"])
def test_a_cloud_has_its_normals(name: str) -> None:
    shape, warnings = loaded(name)
    assert warnings == []
    assert not shape.colored
    assert_ellipsoid(shape)


@pytest.mark.parametrize("name", ["x_rgb01.xyz", "x_intensity_rgb.xyz"])
def test_colors_are_no_normals(name: str) -> None:
    shape, warnings = loaded(name)
    assert any("no normals; estimated" in line for line in warnings)
    assert_ellipsoid(shape)
    assert_colors(shape)
    unused = "columns that are not used: 4 (of 7)"
    assert (unused in warnings) == (name == "x_intensity_rgb.xyz")


@pytest.mark.parametrize(
    ("name", "lost"), [("c_nan_some.ply", 60), ("c_zero_normals_some.ply", 60), ("x_nan_rows.xyz", 3)]
)
def test_damaged_points_are_left_out_and_counted(name: str, lost: int) -> None:
    shape, warnings = loaded(name)
    assert f"left out {lost} points without finite coordinates or a normal" in warnings
    assert_ellipsoid(shape)


@pytest.mark.parametrize(
    ("name", "looked_for"),
    [
        *(("o_no_mtl.obj", ""), ("o_missing_mtl.obj", "not_there.mtl"), ("p_st.ply", "")),
        *(("p_wedge_missing.ply", "gone.png"), ("g_ktx2.glb", "KTX2")),
    ],
)
def test_without_an_image_there_are_no_colors_but_one_warning(
    name: str, looked_for: str, capfd: pytest.CaptureFixture[str]
) -> None:
    shape, warnings = loaded(name)
    assert len(warnings) == 1
    assert warnings[0].startswith(NO_IMAGE)
    assert looked_for in warnings[0]
    assert "--texture FILE" in warnings[0]
    assert not shape.colored
    assert_ellipsoid(shape)
    assert capfd.readouterr() == ("", "")


def test_factors_are_linear_and_multiply() -> None:
    red = np.asarray(to_srgb(np.array((0.8, 0.05, 0.02))))
    assert_colors(loaded("g_factor_only.glb")[0], red.astype(np.float64))
    assert_colors(loaded("g_specgloss.glb")[0], np.asarray(to_srgb(np.array((0.8, 0.1, 0.1))), np.float64))
    shape, warnings = loaded("o_kd_no_uv.obj")
    assert_colors(shape, np.array((0.8, 0.2, 0.1)))
    assert warnings == []
    points, _, colors = samples(loaded("g_tex_factor.glb")[0])
    assert colors is not None
    truth = 0.5 + 0.4 * points / RADII
    linear = 0.2 * np.where(truth < 0.04045, truth / 12.92, ((truth + 0.055) / 1.055) ** 2.4)
    assert np.quantile(np.abs(colors - to_srgb(linear)), 0.97) < 0.03


def test_a_texture_too_fine_for_its_network_becomes_its_mean() -> None:
    shape, _ = loaded("o_checker.obj")
    _, _, colors = samples(shape)
    assert colors is not None
    model = train(shape)
    drawn = interpret.color(lower(model), shape.surface(500, np.random.default_rng(2)).points.astype(np.float32))
    assert np.abs(drawn.mean() - colors.mean()) < 0.1


@pytest.mark.parametrize("name", ["mixed_binary.ply", "cr_line_ends.ply", "uv_sphere_degenerate.obj"])
def test_a_ball_in_an_odd_file_is_a_ball(name: str) -> None:
    shape, warnings = loaded(name)
    assert warnings == []
    points, normals, _ = samples(shape)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=0.02)
    assert (points * normals).sum(axis=1).min() > 0.95
    assert shape.distance(np.zeros((1, 3)))[0] == pytest.approx(-1, abs=0.02)


@pytest.mark.parametrize("name", ["s_tail.stl", "o_comments.obj", "g_sparse.glb", "g_skin.glb"])
def test_an_odd_file_holds_the_ellipsoid(name: str) -> None:
    shape, warnings = loaded(name)
    assert warnings == []
    assert_ellipsoid(shape)


def volume(shape: Shape) -> float:
    """Volume of the shape in the file's units, by random points."""
    places = np.random.default_rng(0).uniform(-1, 1, (200_000, 3))
    return float((shape.distance(places) < 0).mean() * 8 * shape.scale**3)


def test_parts_of_a_glb_are_in_their_places() -> None:
    ellipsoid = 4 / 3 * np.pi * RADII.prod()
    for name, size, count in (("g_quantised_two_parts.glb", 5.5, 1.125), ("g_instances.glb", 6.0, 3.0)):
        shape, _ = loaded(name, crease=None)
        points, _, _ = samples(shape)
        assert np.ptp(points, axis=0) == pytest.approx((size, 1.4, 1.0), abs=0.03)
        assert volume(shape) == pytest.approx(count * ellipsoid, rel=0.12)


def test_a_concave_polygon_has_no_web_across_its_corner() -> None:
    shape, warnings = loaded("n_ell.obj", crease=None)
    assert warnings == []
    places = (np.array([(2.5, 2.5, 0.5), (0.5, 2.5, 0.5), (2.5, 0.5, 0.5)]) - shape.center) / shape.scale
    assert np.round(shape.distance(places) * shape.scale, 6).tolist() == [1.5, -0.5, -0.5]


@pytest.mark.parametrize("name", ["u_utm.obj", "u_utm.xyz"])
def test_large_coordinates_are_kept(name: str) -> None:
    shape, _ = loaded(name)
    middle = np.array((500000.123, 4649776.46, 120.0))
    np.testing.assert_allclose(shape.center, middle, atol=0.02)
    points, _, _ = samples(shape)
    x, y, z = (points - middle).T
    np.testing.assert_allclose(np.hypot(np.hypot(x, y) - 1, z), 0.35, atol=0.015)
    for suffix in (".stl", ".glb"):
        assert "--space model" in rounding_warning(points, shape.scale, suffix)
    assert rounding_warning(points, shape.scale, ".ply") == ""


def test_inward_normals_are_turned_round() -> None:
    shape, warnings = loaded("c_inward_normals.ply")
    assert "the normals point inwards; turned round" in warnings
    assert_ellipsoid(shape)
    assert shape.taken is not None
    assert shape.taken.line().endswith("; turned outward")


def test_faces_of_both_sides_are_one() -> None:
    shape, warnings = loaded("d_both_sides.obj")
    assert warnings == []
    assert shape.distance(np.zeros((1, 3)))[0] == pytest.approx(-1, abs=0.02)


def test_compressed_splats_are_named() -> None:
    with pytest.raises(UserError, match="compressed Gaussian splats"):
        loaded("g_compressed.ply")


@pytest.mark.parametrize("name", ["blender_depth.exr", "blender_depth_normal.exr", "ball_far100.npy", "ball.npy"])
def test_depths_are_those_of_the_ball(name: str) -> None:
    read = read_depth(CASES / "depth" / name)
    depth = read.values
    v, u = np.mgrid[:120, :120]
    x, y = (u + 0.5 - 60) / 150, (v + 0.5 - 60) / 150
    root = 16 - 4 * (x * x + y * y + 1) * 3.75
    truth = np.where(root > 0, (4 - np.sqrt(np.maximum(root, 0))) / (2 * (x * x + y * y + 1)), np.nan)
    np.testing.assert_allclose(depth, truth, atol=1e-5)
    if name.endswith("exr"):
        assert read.notes == ("depths from the channel ViewLayer.Depth.Z",)


@pytest.mark.parametrize("name", ["neus_plain", "neus_padded", "nerf_synthetic", "neus2", "ns_bom", "ns_3x4"])
def test_each_photograph_has_its_camera(name: str) -> None:
    found, warnings = read_photographs(CASES / "photos" / name)
    assert warnings == []
    assert len(found.views) == 16
    assert agreement(found) == pytest.approx(1, abs=0.01)
    for k, view in enumerate(found.views):
        number = int(Path(view.name).stem.removeprefix("r_"))
        azimuth, elevation = 2 * math.pi * number / 16, math.radians(20 if number % 2 else -5)
        away = np.array(
            (math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation))
        )
        np.testing.assert_allclose(view.eye * found.scale + found.center, 3 * away, atol=1e-6, err_msg=f"view {k}")


def test_photographs_that_cannot_be_used_are_refused() -> None:
    with pytest.raises(UserError, match="camera model OPENCV_FISHEYE is not known"):
        read_photographs(CASES / "photos" / "ns_fisheye")
    with pytest.raises(UserError, match="0 photographs with cameras"):
        read_photographs(CASES / "photos" / "colmap")  # its model lists none


def test_python_takes_what_files_hold() -> None:
    mesh: Any = trimesh.load(CASES / "uv_sphere_degenerate.obj", process=False)
    scene: Any = trimesh.Scene(mesh)
    moved = np.eye(4)
    moved[0, 3] = 5
    scene.add_geometry(mesh, transform=moved)
    line = mplicits.check(scene).line
    assert line.startswith("arrays: 2 meshes, 1,440 triangles, 2 parts")
    with np.load(CASES / "n_colors.npz") as arrays:
        points, colors = arrays["points"], arrays["colors"]
    point_cloud: Any = trimesh.PointCloud
    cloud = point_cloud(points, np.round(colors * 255).astype(np.uint8))
    for shape in (cloud, points, (points,), {"xyz": points}):
        assert mplicits.check(shape, noise=0).line.startswith("arrays: 3,000 points, normals estimated")
    assert mplicits.check((mesh.vertices, mesh.faces.astype(float))).line.startswith("arrays: 1 mesh, 720 triangles")
    assert mplicits.check((points, points, np.round(colors * 255).astype(np.uint8)), noise=0).facts["colors"]


def test_the_line_is_printed_without_training(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    picture = tmp_path / "p.png"
    assert cli.main(["check", str(CASES / "o_ok.obj"), "-o", str(picture)]) == 0
    assert capsys.readouterr().out == (
        "o_ok.obj: 1 mesh, 1,840 triangles, 1 part, texture 256 x 128, y up, 1.4 units tall\n"
    )
    assert picture.read_bytes().startswith(b"\x89PNG")
    argv = ["check", str(CASES / "x_rgb_then_normals.xyz"), "--columns", "x,y,z,nx,ny,nz,-,-,-"]
    assert cli.main(argv) == 0
    assert "warning: x_rgb_then_normals.xyz: columns that are not used" in capsys.readouterr().out
