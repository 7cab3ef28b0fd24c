"""The layout of nerfstudio, and of what exports COLMAP's cameras so: transforms.json beside the pictures."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.orientation import upright
from .intrinsics import Intrinsics, of_one_shape
from .pictures import SUFFIXES, Found, FoundView, check_projection, size_of, up_of
from .posed import Doubles

TRANSFORMS = "transforms.json"
DISTORTIONS = ("k1", "k2", "k3", "k4", "p1", "p2")
"""Of lenses."""
STRAIGHT = 1e-4
"""Smaller distortions are none."""


def find_in_transforms(folder: Path, sphere: Doubles | None, up: str | None) -> Found:
    """Find the photographs that a transforms.json lists.

    Each has a file_path, a transform_matrix from its camera (which looks along -z, y up) to the cameras' space, and may
    have a mask_path. fl_x, fl_y, cx, cy, w and h, or camera_angle_x, stand in each frame or for all of them. sphere:
    (4,), centre and radius of the ball that the object is in; None: the ball around the point that the cameras look at
    which all of them see. up: axis of the cameras' space that points up; None: z, or the one that points up in the
    pictures. Raises UserError.
    """
    path = folder / TRANSFORMS
    content = _read(path)
    views, eyes, axes, reach = [], [], [], []
    warnings: list[str] = []
    for i, frame in enumerate(content["frames"]):
        label = f"{show(path)}, frame {i}"
        if not isinstance(frame, dict) or not isinstance(frame.get("file_path"), str):
            raise UserError(f"{label}: no file_path")
        image = _picture(folder, frame["file_path"])
        size = size_of(image)
        pose = _pose(frame, label)
        values = {key: value for key, value in content.items() if key != "frames"} | frame
        camera, bent = _camera(values, size, label)
        if bent and not warnings:
            warnings.append(f"{label}: its lens distortion is ignored; undistort the pictures where it is large")
        intrinsics = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
        projection = intrinsics @ (np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(pose))[:3]
        mask = frame.get("mask_path")
        views.append(
            FoundView(
                image,
                folder / mask if isinstance(mask, str) else None,
                *size,
                check_projection(projection, label),
            )
        )
        eyes.append(pose[:3, 3])
        axes.append(-pose[:3, 2] / np.linalg.norm(pose[:3, 2]))
        reach.append(math.sin(math.atan(min(size[0] / camera.fx, size[1] / camera.fy) / 2)))
    if sphere is None and views:
        sphere = _ball(np.array(eyes), np.array(axes), np.array(reach))
    centre, radius = (np.zeros(3), 1.0) if sphere is None else (sphere[:3], float(sphere[3]))
    up = up or up_of(views, "z")
    to_model = np.eye(4)
    to_model[:3, :3], to_model[:3, 3] = radius * upright(np.eye(3), up), centre
    return Found(views, upright(centre, up), radius, to_model, up, warnings)


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        raise UserError(f"{show(path)}: not readable JSON") from None
    if not isinstance(content, dict) or not isinstance(content.get("frames"), list):
        raise UserError(f"{show(path)}: no list of frames in it")
    return content


def _picture(folder: Path, name: str) -> Path:
    """Return the path of a picture whose ending may be left out."""
    path = folder / name
    if path.suffix.lower() not in SUFFIXES:
        path = next((other for suffix in SUFFIXES if (other := Path(f"{path}{suffix}")).is_file()), path)
    return path


def _pose(frame: Mapping[str, Any], label: str) -> Doubles:
    """Read a frame's matrix from camera to space. Raises UserError."""
    if "transform_matrix" not in frame:
        raise UserError(f"{label}: no camera; it has no transform_matrix")
    try:
        pose = np.array(frame["transform_matrix"], np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape != (4, 4):
        raise UserError(f"{label}: a camera is a matrix of 4 x 4 finite numbers")
    check_projection(pose, label)
    return pose


def _camera(values: Mapping[str, Any], size: tuple[int, int], label: str) -> tuple[Intrinsics, bool]:
    """Read the camera of a picture of a size, and whether its lens is bent. Raises UserError."""
    width, height = size
    try:
        given = [float(values.get(key, pixels)) for key, pixels in (("w", width), ("h", height))]
        if "fl_x" in values:
            fx = float(values["fl_x"])
            fy = float(values.get("fl_y", fx))
        else:
            fx = fy = given[0] / 2 / math.tan(float(values["camera_angle_x"]) / 2)
        cx, cy = (float(values.get(key, side / 2)) for key, side in zip(("cx", "cy"), given, strict=True))
        bent = any(abs(float(values.get(key, 0))) > STRAIGHT for key in DISTORTIONS)
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        raise UserError(f"{label}: no camera; fl_x, fl_y, cx, cy or camera_angle_x are needed") from None
    if not all(map(math.isfinite, (fx, fy, cx, cy, *given))) or min(fx, fy, *given) <= 0:
        raise UserError(f"{label}: focal lengths and sizes must be above 0, and all numbers finite")
    if not of_one_shape((given[0], given[1]), size):
        raise UserError(
            f"{label}: its camera is for a picture of {given[0]:g} x {given[1]:g}, this is {width} x {height}"
        )
    across, down = width / given[0], height / given[1]
    return Intrinsics(fx * across, fy * down, cx * across, cy * down), bent


def _ball(eyes: Doubles, axes: Doubles, reach: Doubles) -> Doubles:
    """Return centre and radius (4,) of a ball that all cameras see: around the point nearest to their axes.

    eyes, axes: (N, 3). reach: (N,), sines of the half of each narrower angle of view.
    """
    across = np.eye(3) - axes[:, :, None] * axes[:, None]
    centre = np.linalg.lstsq(across.sum(axis=0), (across @ eyes[..., None]).sum(axis=0)[:, 0], rcond=None)[0]
    away = np.linalg.norm(eyes - centre, axis=1)
    return np.append(centre, max(float((away * reach).min()), 1e-9))
