"""Layouts of photographs beyond those of the cases: COLMAP's models, gaps, masks by name, and wrong pairings."""

import json
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from mplicits.capture.folder import read_photographs
from mplicits.capture.pairing import AGREE, agreement, pairing_line
from mplicits.model.errors import UserError
from support.ball_photographs import poses, write_sphere_layout, write_transforms_layout
from support.colmap import COUNT, SIZE, write_colmap


def test_a_text_model_without_its_empty_lines_loses_no_picture(tmp_path: Path) -> None:
    write_colmap(tmp_path, binary=False)
    path = tmp_path / "sparse" / "0" / "images.txt"
    path.write_text("\n".join(line for line in path.read_text().splitlines() if line))
    found, _ = read_photographs(tmp_path, sphere=(0.0, 0.0, 0.0, 1.0), up="y")
    assert [view.name for view in found.views] == [f"{k:03}.png" for k in range(COUNT)]
    assert agreement(found) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("model", ["PINHOLE", "OPENCV"])
def test_colmap_s_models_are_read(binary: bool, model: str, tmp_path: Path) -> None:
    write_colmap(tmp_path, binary, model)
    found, warnings = read_photographs(tmp_path, sphere=(0.0, 0.0, 0.0, 1.0), up="y")
    assert warnings == []
    assert [view.name for view in found.views] == [f"{k:03}.png" for k in range(COUNT)]
    for view, pose in zip(found.views, poses(COUNT), strict=True):
        np.testing.assert_allclose(view.eye, pose[:3, 3], atol=1e-9)
    assert agreement(found) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("binary", [False, True])
def test_a_lens_that_is_no_pinhole_is_refused(binary: bool, tmp_path: Path) -> None:
    write_colmap(tmp_path, binary, "OPENCV_FISHEYE")
    with pytest.raises(UserError, match="camera model OPENCV_FISHEYE is not known; undistort"):
        read_photographs(tmp_path)


def test_damaged_models_are_one_line(tmp_path: Path) -> None:
    write_colmap(tmp_path, True)
    path = tmp_path / "sparse" / "0" / "images.bin"
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(UserError, match="not a readable sparse model"):
        read_photographs(tmp_path)


def test_a_missing_picture_leaves_a_gap_not_a_shift(tmp_path: Path) -> None:
    write_sphere_layout(tmp_path / "s", COUNT, SIZE)
    for folder in ("image", "mask"):
        (tmp_path / "s" / folder / "003.png").unlink()
    found, warnings = read_photographs(tmp_path / "s")
    assert len(found.views) == COUNT - 1
    assert agreement(found) == pytest.approx(1, abs=0.01)
    assert "000.png is taken with world_mat_0, and so on" in warnings[0]
    eyes = {view.name: view.eye.tolist() for view in found.views}
    for folder in ("image", "mask"):
        for k in (number for number in reversed(range(COUNT)) if number != 3):
            (tmp_path / "s" / folder / f"{k:03}.png").rename(tmp_path / "s" / folder / f"{k + 1}.png")
    found, _ = read_photographs(tmp_path / "s")
    assert all(view.eye.tolist() == eyes[f"{int(view.name[:-4]) - 1:03}.png"] for view in found.views)


def test_hidden_files_are_no_photographs(tmp_path: Path) -> None:
    write_sphere_layout(tmp_path / "s", COUNT, SIZE)
    for k in range(COUNT):
        (tmp_path / "s" / "image" / f"._{k:03}.png").write_bytes(b"\0\5\x16\7mac")
    assert len(read_photographs(tmp_path / "s")[0].views) == COUNT


def test_photographs_of_other_cameras_are_said(tmp_path: Path) -> None:
    write_sphere_layout(tmp_path / "s", COUNT, SIZE)
    found, _ = read_photographs(tmp_path / "s")
    line, warning = pairing_line(found)
    assert line.startswith(f"s: {COUNT} photographs of {SIZE} x {SIZE}, y up, cameras 3 radii")
    assert warning == ""
    # The ball looks alike from all sides: move it out of the middle of each picture.
    masks = [np.roll(view.mask, (k * 3) % 17, axis=1) for k, view in enumerate(found.views) if view.mask is not None]
    wrong = replace(found, views=tuple(replace(v, mask=m) for v, m in zip(found.views, masks, strict=True)))
    share = agreement(wrong)
    assert share is not None
    assert share < AGREE
    assert "in the order of the cameras" in pairing_line(wrong)[1]


@pytest.mark.parametrize(
    ("key", "value"), [("camera_model", "EQUIRECTANGULAR"), ("is_fisheye", True), ("camera_type", "fisheye")]
)
def test_unknown_cameras_of_a_transforms_file_are_refused(key: str, value: object, tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 4, SIZE)
    path = tmp_path / "t" / "transforms.json"
    path.write_text(json.dumps({"camera_model": "OPENCV"} | json.loads(path.read_text()) | {key: value}))
    with pytest.raises(UserError, match="is not known; undistort"):
        read_photographs(tmp_path / "t")


def test_neus2_s_cameras_may_have_y_down(tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", COUNT, SIZE)
    path = tmp_path / "t" / "transforms.json"
    content = json.loads(path.read_text())
    for frame in content["frames"]:
        frame["transform_matrix"] = (np.array(frame["transform_matrix"]) @ np.diag([1, -1, -1, 1])).tolist()
    path.write_text(json.dumps(content | {"from_na": True}))
    found, _ = read_photographs(tmp_path / "t")
    assert agreement(found) == pytest.approx(1, abs=0.01)


def test_long_lists_of_a_camera_that_frames_share_are_not_read_for_each_frame(tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "s", COUNT, SIZE)
    path = tmp_path / "s" / "transforms.json"
    content = json.loads(path.read_text())
    content["frames"] *= 60
    path.write_text(json.dumps(content))
    began = process_time()
    read_photographs(path.parent)
    took = process_time() - began
    content |= {"distortion_params": [0] * 100_000, **dict.fromkeys(map(str, range(60_000)), 1)}
    path.write_text(json.dumps(content))
    began = process_time()
    read_photographs(path.parent)
    assert process_time() - began < 2 * took + 1  # twelve seconds more
