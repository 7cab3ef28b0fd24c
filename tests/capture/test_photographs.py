"""Loading photographs with cameras in both layouts, and errors for bad folders."""

import io
import json
import resource
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.capture.folder import read_photographs
from mplicits.capture.options import PhotoOptions
from mplicits.capture.photographs import split
from mplicits.capture.session import reconstruction
from mplicits.model.errors import UserError
from mplicits.model.orientation import as_in_file
from mplicits.trainer.progress import TrainingBar
from support.ball_photographs import RADIUS, poses, write_sphere_layout, write_transforms_layout

SIZE = 24
SPHERE = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def sphere_layout(tmp_path: Path) -> Path:
    write_sphere_layout(tmp_path / "sphere", 5, SIZE)
    return tmp_path / "sphere"


def test_both_layouts_have_the_same_rays(sphere_layout: Path, tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "transforms", 5, SIZE)
    one, _ = read_photographs(sphere_layout)
    other, _ = read_photographs(tmp_path / "transforms", sphere=SPHERE, up="y")
    assert one.masked
    assert other.masked
    assert one.center == pytest.approx((5, 6, 7))
    assert one.scale == pytest.approx(2)
    for a, b, pose in zip(one.views, other.views, poses(5), strict=True):
        np.testing.assert_allclose(a.eye, pose[:3, 3], atol=1e-9)
        np.testing.assert_allclose(b.eye, pose[:3, 3], atol=1e-9)
        np.testing.assert_allclose(a.directions(), b.directions(), atol=1e-9)
        assert a.mask is not None
        np.testing.assert_array_equal(a.mask, b.mask)
        nearest = np.linalg.norm(np.cross(a.directions(), a.eye), axis=-1)
        np.testing.assert_array_equal(a.mask, nearest < RADIUS)


def test_transforms_without_a_sphere_use_the_ball_that_all_cameras_see(tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 5, SIZE)
    found, _ = read_photographs(tmp_path / "t", up="z")
    assert found.center == pytest.approx((0, 0, 0), abs=1e-9)
    assert RADIUS < found.scale < 1
    turned = np.array([view.eye for view in found.views]) * found.scale
    np.testing.assert_allclose(turned[:, 1], [pose[2, 3] for pose in poses(5)], atol=1e-9)


@pytest.mark.parametrize("up", ["y", "-y", "z", "-x"])
def test_up_comes_from_the_photographs(up: str, tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 5, SIZE)
    as_it_was, _ = read_photographs(tmp_path / "t")
    assert as_it_was.up == "y"
    content = json.loads((tmp_path / "t" / "transforms.json").read_text())
    turned = np.eye(4)
    turned[:3, :3] = as_in_file(np.eye(3), up)
    for frame in content["frames"]:
        frame["transform_matrix"] = (turned.T @ np.array(frame["transform_matrix"])).tolist()
    (tmp_path / "t" / "transforms.json").write_text(json.dumps(content))
    found, _ = read_photographs(tmp_path / "t")
    assert found.up == up
    for before, after in zip(as_it_was.views, found.views, strict=True):
        np.testing.assert_allclose(after.eye, before.eye, atol=1e-9)


def test_up_directions_that_cancel_fall_back_to_z(tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 4, SIZE)
    content = json.loads((tmp_path / "t" / "transforms.json").read_text())
    for frame, upside_down in zip(content["frames"], (False, True, False, True), strict=True):
        matrix = np.array(content["frames"][0]["transform_matrix"])
        frame["transform_matrix"] = (matrix @ np.diag([-1, -1, 1, 1] if upside_down else [1, 1, 1, 1])).tolist()
    (tmp_path / "t" / "transforms.json").write_text(json.dumps(content))
    assert read_photographs(tmp_path / "t")[0].up == "z"


def test_shrunk_photographs_have_the_same_camera(sphere_layout: Path) -> None:
    whole, _ = read_photographs(sphere_layout)
    half, _ = read_photographs(sphere_layout, 0.5)
    directions = whole.views[0].directions()
    mean = (directions[::2, ::2] + directions[1::2, ::2] + directions[::2, 1::2] + directions[1::2, 1::2]) / 4
    np.testing.assert_allclose(half.views[0].directions(), mean, atol=1e-3)


def test_too_many_pixels_are_refused_before_one_is_loaded(sphere_layout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.capture.folder.MOST_PIXELS", 5 * SIZE**2 // 4)
    monkeypatch.setattr("mplicits.capture.folder.load_photograph", pytest.fail)
    with pytest.raises(UserError, match="sphere: too many pixels for the memory; set a smaller --scale"):
        read_photographs(sphere_layout, 0.6)


def test_cameras_of_larger_photographs_need_camera_size(sphere_layout: Path) -> None:
    before, _ = read_photographs(sphere_layout, 0.5)
    for path in (*(sphere_layout / "image").iterdir(), *(sphere_layout / "mask").iterdir()):
        Image.open(path).reduce(2).save(path)
    with pytest.raises(UserError, match=r"look at pixel 1\d, 1\d, the pictures are 12 x 12; .*--camera-size"):
        read_photographs(sphere_layout)
    after, _ = read_photographs(sphere_layout, camera_size=(SIZE, SIZE))
    np.testing.assert_allclose(after.views[1].directions(), before.views[1].directions(), atol=1e-9)
    with pytest.raises(UserError, match="of another aspect"):
        read_photographs(sphere_layout, camera_size=(2 * SIZE, SIZE))


def test_every_third_view_is_held_out(sphere_layout: Path) -> None:
    photographs, _ = read_photographs(sphere_layout)
    training, held_out = split(photographs, 3)
    assert [view.name for view in held_out] == ["001.png", "004.png"]
    assert len(training) == 3
    assert split(photographs, 0)[1] == []


def change(folder: Path, key: str, matrix: NDArray[np.float64] | None) -> None:
    """Set or remove (None) a matrix of cameras_sphere.npz."""
    with np.load(folder / "cameras_sphere.npz") as file:
        matrices: dict[str, Any] = {name: file[name] for name in file.files if name != key}
    matrices |= {} if matrix is None else {key: matrix}
    np.savez(folder / "cameras_sphere.npz", **matrices)


def test_a_bad_folder_is_one_line(sphere_layout: Path) -> None:
    def refused(match: str) -> None:
        with pytest.raises(UserError, match=match) as raised:
            read_photographs(sphere_layout)
        assert "\n" not in str(raised.value)

    with np.load(sphere_layout / "cameras_sphere.npz") as file:
        matrix = file["world_mat_2"]
    change(sphere_layout, "world_mat_2", None)
    refused("002.png: no camera for it; .* has no world_mat_2")
    change(sphere_layout, "world_mat_2", np.zeros((4, 4)))
    refused("world_mat_2: the camera's matrix is singular")
    change(sphere_layout, "world_mat_2", np.full((4, 4), np.nan))
    refused("world_mat_2: a camera is a matrix of 4 x 4 finite numbers")
    change(sphere_layout, "world_mat_2", matrix)
    for path in (sphere_layout / "mask").iterdir():
        Image.new("L", (SIZE, SIZE)).save(path)
    refused("all masks are black")
    Image.new("L", (SIZE, 2 * SIZE)).save(sphere_layout / "mask" / "000.png")
    refused(f"000.png: {SIZE} x {2 * SIZE}, its photograph")
    (sphere_layout / "mask" / "000.png").unlink()
    refused("5 pictures in image/ and 4 in mask/")
    for i in (2, 3, 4):
        (sphere_layout / "image" / f"{i:03}.png").unlink()
    shutil.rmtree(sphere_layout / "mask")
    refused("2 photographs with cameras; at least 3")
    (sphere_layout / "cameras_sphere.npz").write_bytes(b"PK")
    refused("not a readable NPZ file")
    (sphere_layout / "cameras_sphere.npz").unlink()
    refused("no cameras; ")
    shutil.rmtree(sphere_layout)
    refused("no such folder")


@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"frames": [{}] * 3}, "frame 0: no file_path"),
        ({"fl_x": "wide"}, "frame 0: no camera; fl_x"),
        ({"fl_x": -1.0}, "must be above 0"),
        ({"w": 2 * SIZE}, f"its camera is for a picture of {2 * SIZE} x {SIZE}, this is {SIZE} x {SIZE}"),
        ({"frames": [{"file_path": "000.png"}] * 3}, "frame 0: no camera; transform_matrix is missing"),
        ({"frames": [{"file_path": "000.png", "transform_matrix": [[0.0] * 4] * 4}] * 3}, "singular"),
        ({"frames": [{"file_path": "000.png", "transform_matrix": np.diag([1.0, 1, 1, 0]).tolist()}] * 3}, "last row"),
        ({"frames": [{"file_path": "9.png", "transform_matrix": np.eye(4).tolist()}] * 3}, "9.png: no such file"),
    ],
)
def test_a_bad_transforms_file_is_one_line(tmp_path: Path, changed: dict[str, object], match: str) -> None:
    write_transforms_layout(tmp_path / "t", 3, SIZE)
    path = tmp_path / "t" / "transforms.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changed))
    with pytest.raises(UserError, match=match):
        read_photographs(tmp_path / "t")


def test_lens_distortion_causes_a_warning(tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 3, SIZE)
    path = tmp_path / "t" / "transforms.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"k1": 0.1}))
    _, warnings = read_photographs(tmp_path / "t")
    assert len(warnings) == 1
    assert "distortion is ignored" in warnings[0]


def test_matrices_that_unpack_to_more_than_a_matrix_are_not_read(sphere_layout: Path) -> None:
    """An NPZ of some kilobytes whose first array would take 800 MB."""
    cameras = sphere_layout / "cameras_sphere.npz"
    with np.load(cameras) as file:
        matrices = {key: file[key] for key in file.files}
    with zipfile.ZipFile(cameras, "w", zipfile.ZIP_DEFLATED) as packed:
        for key, matrix in matrices.items():
            data = io.BytesIO()
            np.save(data, matrix)
            packed.writestr(f"{key}.npy", data.getvalue())
        header = {"descr": "<f8", "fortran_order": False, "shape": (10_000, 10_000)}
        with packed.open("world_mat_9.npy", "w") as file:
            np.lib.format.write_array_header_1_0(file, header)
            for _ in range(8):
                file.write(bytes(1 << 20))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert len(read_photographs(sphere_layout)[0].views) == 5
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 100_000


@pytest.mark.parametrize(
    ("key", "matrix", "said"),
    [
        ("scale_mat_0", np.diag([1e-300] * 3 + [1.0]), "scale_mat_0: the numbers of a camera"),
        ("world_mat_1", np.full((4, 4), 1e300), "world_mat_1: the numbers of a camera"),
    ],
)
def test_cameras_at_the_edges_are_one_line(
    key: str, matrix: NDArray[np.float64], said: str, sphere_layout: Path
) -> None:
    change(sphere_layout, key, matrix)
    with pytest.raises(UserError, match=said) as caught:
        read_photographs(sphere_layout)
    assert str(caught.value).isprintable()


def test_masks_that_show_nothing_are_one_line(sphere_layout: Path, tmp_path: Path) -> None:
    """Only the photograph that is held out has a mask that is not black; or the ball is where nobody looks."""
    for number in (0, 1, 3, 4):
        Image.new("L", (SIZE, SIZE), 0).save(sphere_layout / "mask" / f"{number:03}.png")
    options = PhotoOptions(levels="4x0", radiance=4, rays=16, steps=1, quiet=True, held_out=5)
    with pytest.raises(UserError, match="no mask shows a part of the ball"):
        reconstruction(sphere_layout, options, TrainingBar(quiet=True))
    write_transforms_layout(tmp_path / "t", 5, SIZE)
    far = replace(options, sphere=(1e6, 0.0, 0.0, 1.0))
    with pytest.raises(UserError, match="no photograph shows the ball"):
        reconstruction(tmp_path / "t", far, TrainingBar(quiet=True))
