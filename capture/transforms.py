"""The layout of nerfstudio, and of COLMAP's exports: transforms.json beside the pictures."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.references import Folder
from .cloud import Doubles
from .intrinsics import UNFIT, Intrinsics, same_shape
from .photograph_files import (
    SUFFIXES,
    Layout,
    PhotographFile,
    ball_of,
    check_projection,
    mask_beside,
    named_file,
    nearest_to_axes,
    reach_of,
    size_of,
    up_of,
)

TRANSFORMS = ("transforms.json", "transforms_train.json")
"""Names of the file of cameras: nerfstudio's and NeuS2's, and NeRF's synthetic scenes'."""
PINHOLES = {"", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "OPENCV", "SIMPLE_RADIAL", "RADIAL"}
"""Camera models that are pinholes but for a distortion, which is ignored with a warning."""
OPENCV_AXES = np.diag([1.0, -1.0, -1.0, 1.0])
"""From a camera with y down that looks along z to one with y up that looks along -z."""
DISTORTIONS = ("k1", "k2", "k3", "k4", "p1", "p2")
"""Names of lens distortions."""
STRAIGHT = 1e-4  # smaller distortions are ignored without a warning
MOST_DISTORTIONS = 32
"""Most numbers of `distortion_params`, which all frames share."""
CAMERA = {
    *("camera_model", "camera_type", "is_fisheye", "w", "h", "fl_x", "fl_y", "cx", "cy", "camera_angle_x"),
    *("intrinsic_matrix", "distortion_params", *DISTORTIONS),
}
"""Keys of a camera, in a frame or at the top."""


def find_in_transforms(root: Folder, path: Path, sphere: Doubles | None, up: str | None) -> Layout:
    """Find the photographs of a transforms.json, which is `path`, in a folder.

    Each frame has a file_path, a transform_matrix from its camera (which looks along -z, y up) to the cameras' space,
    and optionally a mask_path. fl_x, fl_y, cx, cy, w and h, or camera_angle_x, are in each frame or at the top.
    sphere: (4,), center and radius of a ball around the object; None: a ball that all cameras see. up: axis of the
    cameras' space that points up; None: as in the photographs, or z. Raises UserError.
    """
    content = _read(path)
    turned = content.get("from_na") is True and _look_away(content["frames"], show(path))
    files, eyes, axes, reach = [], [], [], []
    warnings: list[str] = []
    shared = {key: content[key] for key in CAMERA & content.keys()}
    for i, frame in enumerate(content["frames"]):
        label = f"{show(path)}, frame {i}"
        if not isinstance(frame, dict) or not isinstance(frame.get("file_path"), str):
            raise UserError(f"{label}: no file_path")
        image = _picture(root, frame["file_path"], label)
        size = size_of(image)
        pose = _pose(frame, label) @ (OPENCV_AXES if turned else np.eye(4))
        camera, distorted = _camera(shared | {key: frame[key] for key in CAMERA & frame.keys()}, size, label)
        if distorted and not warnings:
            warnings.append(f"{label}: its lens distortion is ignored; undistort the pictures if it is large")
        intrinsics = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
        projection = intrinsics @ (np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(pose))[:3]
        masked = frame.get("mask_path")
        mask = named_file(root, [masked], label) if isinstance(masked, str) else mask_beside(root, image.name)
        files.append(PhotographFile(image, mask, size, check_projection(projection, label)))
        eyes.append(pose[:3, 3])
        axes.append(-pose[:3, 2] / np.linalg.norm(pose[:3, 2]))
        reach.append(reach_of(size, camera))
    if sphere is None:
        sphere = ball_of(np.array(eyes), np.array(axes), np.array(reach)) if files else np.array([0.0, 0.0, 0.0, 1.0])
    return Layout(files, sphere[:3], float(sphere[3]), up or up_of(files, "z"), warnings)


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        raise UserError(f"{show(path)}: not readable JSON") from None
    if not isinstance(content, dict) or not isinstance(content.get("frames"), list):
        raise UserError(f"{show(path)}: the list of frames is missing")
    return content


def _picture(root: Folder, name: str, label: str) -> Path:
    """Return the path of a picture, whose ending may be missing in the file. Raises UserError."""
    endings = () if Path(name).suffix.lower() in SUFFIXES else SUFFIXES
    return named_file(root, [*(name + ending for ending in endings), name], label)


def _pose(frame: Mapping[str, Any], label: str) -> Doubles:
    """Read a frame's matrix from its camera to the cameras' space. Raises UserError."""
    if "transform_matrix" not in frame:
        raise UserError(f"{label}: no camera; transform_matrix is missing")
    try:
        pose = np.array(frame["transform_matrix"], np.float64)
    except (TypeError, ValueError, OverflowError):
        pose = np.empty(0)
    if pose.shape == (3, 4):
        pose = np.concatenate((pose, [[0.0, 0.0, 0.0, 1.0]]))
    if pose.shape != (4, 4):
        raise UserError(f"{label}: a camera is a matrix of 4 x 4 finite numbers")
    check_projection(pose, label)
    if not np.allclose(pose[3], (0, 0, 0, 1)):
        raise UserError(f"{label}: the last row of a camera's matrix is 0 0 0 1")
    return pose


def _look_away(frames: list[Any], label: str) -> bool:
    """Whether most cameras of NeuS2 look away from the point nearest to their axes: their y then points down."""
    poses = [_pose(frame, f"{label}, frame {i}") for i, frame in enumerate(frames) if isinstance(frame, dict)]
    if not poses:
        return False
    eyes, axes = np.array([p[:3, 3] for p in poses]), np.array([-p[:3, 2] / np.linalg.norm(p[:3, 2]) for p in poses])
    ahead = np.einsum("ij,ij->i", nearest_to_axes(eyes, axes) - eyes, axes) > 0
    return bool(ahead.mean() < 0.5)


def _camera(values: Mapping[str, Any], size: tuple[int, int], label: str) -> tuple[Intrinsics, bool]:
    """Read a camera, and whether its lens is distorted. size: of the picture. Raises UserError."""
    width, height = size
    models = [str(values.get(key, "")) for key in ("camera_model", "camera_type")]
    models += ["is_fisheye"] if values.get("is_fisheye") is True else []
    if unknown := next((model for model in models if model.upper() not in PINHOLES), None):
        shown = show(unknown)[:40]
        raise UserError(f"{label}: the camera model {shown} is not known; undistort the pictures to a pinhole")
    try:
        w, h = (float(values.get(key, pixels)) for key, pixels in (("w", width), ("h", height)))
        if "fl_x" in values:
            fx = float(values["fl_x"])
            fy = float(values.get("fl_y", fx))
        elif isinstance(values.get("intrinsic_matrix"), list):  # NeuS2
            matrix = np.array([row[:4] for row in values["intrinsic_matrix"][:4]], np.float64)
            fx, fy = float(matrix[0, 0]), float(matrix[1, 1])
            values = {"cx": matrix[0, 2], "cy": matrix[1, 2]} | dict(values)
        else:
            fx = fy = w / 2 / math.tan(float(values["camera_angle_x"]) / 2)
        cx, cy = float(values.get("cx", w / 2)), float(values.get("cy", h / 2))
        lens = [values.get(key, 0) for key in DISTORTIONS]
        lens += list(values.get("distortion_params") or ())[:MOST_DISTORTIONS]
        distorted = any(abs(float(number)) > STRAIGHT for number in lens)
    except (KeyError, TypeError, ValueError, ArithmeticError, IndexError):
        raise UserError(f"{label}: no camera; fl_x, fl_y, cx, cy or camera_angle_x are needed") from None
    if not Intrinsics(fx, fy, cx, cy).fits(w, h):
        raise UserError(f"{label}: {UNFIT}")
    if not same_shape((w, h), size):
        raise UserError(f"{label}: its camera is for a picture of {w:g} x {h:g}, this is {width} x {height}")
    return Intrinsics(fx, fy, cx, cy).scaled(width / w, height / h), distorted
