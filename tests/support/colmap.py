"""Photographs of a ball in the layout of COLMAP."""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from support.ball_photographs import FOCAL, poses, write_transforms_layout

SIZE, COUNT = 48, 12
"""Pixels of a side, and photographs."""


def quaternion(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """W x y z of a rotation (3, 3)."""
    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return np.array((w, x, y, z))


def write_colmap(folder: Path, binary: bool, model: str = "PINHOLE") -> None:
    """Write the ball's photographs in the layout of COLMAP, in reverse order, each with two points."""
    write_transforms_layout(folder / "images", COUNT, SIZE)
    (folder / "images" / "transforms.json").unlink()
    sparse = folder / "sparse" / "0"
    sparse.mkdir(parents=True)
    numbers = [FOCAL * SIZE, FOCAL * SIZE, SIZE / 2, SIZE / 2] + [0.0] * (4 if "OPENCV" in model else 0)
    views = []
    for k, pose in reversed(list(enumerate(poses(COUNT)))):
        outside = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(pose)
        views.append((k + 1, quaternion(outside[:3, :3]), outside[:3, 3], f"{k:03}.png"))
    if binary:
        kinds = {"PINHOLE": 1, "OPENCV": 4, "OPENCV_FISHEYE": 5}
        head = struct.pack("<QiiQQ", 1, 7, kinds[model], SIZE, SIZE)
        (sparse / "cameras.bin").write_bytes(head + struct.pack(f"<{len(numbers)}d", *numbers))
        data = struct.pack("<Q", len(views))
        for number, turn, moved, name in views:
            data += struct.pack("<i7di", number, *turn, *moved, 7) + name.encode() + b"\0"
            data += struct.pack("<Q", 2) + 2 * struct.pack("<ddq", 1, 2, -1)
        (sparse / "images.bin").write_bytes(data)
        return
    (sparse / "cameras.txt").write_text(f"# cameras\n7 {model} {SIZE} {SIZE} {' '.join(map(str, numbers))}\n")
    lines = ["# two lines for each image"]
    for number, turn, moved, name in views:
        lines += [" ".join(map(str, [number, *turn, *moved, 7, name])), "1 2 -1 3 4 -1" if number % 2 else ""]
    (sparse / "images.txt").write_text("\n".join(lines) + "\n")
