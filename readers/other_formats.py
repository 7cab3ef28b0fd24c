"""Reads formats by other libraries: OFF and 3MF by trimesh, PCD, LAS and E57 by those of the extra `formats`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from .clouds import cloud_of_columns, finite_cloud
from .content import Cloud, Facts, Mesh


def read_with_trimesh(path: Path) -> Mesh:
    """Read an OFF or a 3MF file. Raises UserError."""
    import trimesh

    from .from_trimesh import content_of

    content = content_of(trimesh.load_scene(path, process=False))
    if not isinstance(content, Mesh):
        raise UserError("the mesh is empty; a shape needs triangles or points")
    return content


def read_pcd(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read a PCD file of PCL. Raises UserError."""
    import pypcd4

    library: Any = pypcd4
    cloud = library.PointCloud.from_path(path)
    data = cloud.pc_data
    return cloud_of_columns(list(data.dtype.names), [data[name] for name in data.dtype.names], chosen)


def read_las(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read a LAS or LAZ file, its colors of 8 or 16 bits. Raises UserError."""
    import laspy

    las: Any = laspy.read(path)
    points = np.stack((np.asarray(las.x), np.asarray(las.y), np.asarray(las.z)), axis=1).astype(np.float64)
    names, facts = set(las.point_format.dimension_names), Facts()
    normals = colors = None
    if {"NormalX", "NormalY", "NormalZ"} <= names:
        normals = np.stack([np.asarray(las[name], np.float64) for name in ("NormalX", "NormalY", "NormalZ")], axis=1)
    if {"red", "green", "blue"} <= names:
        rgb = np.stack([np.asarray(las[name], np.float64) for name in ("red", "green", "blue")], axis=1)
        if rgb.any():  # many programs write bytes into the 16 bits
            colors = rgb / (255.0 if rgb.max() <= 255 else 65535.0)
    facts.taken.append("columns x y z" + " normals" * (normals is not None) + " red green blue" * (colors is not None))
    return finite_cloud(points, normals, colors, facts)


def read_e57(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read all scans of an E57 file, in their common coordinates. Raises UserError."""
    import pye57

    file: Any = pye57.E57(str(path))
    points, colors, count = [], [], int(file.scan_count)
    for number in range(count):
        scan = file.read_scan(number, colors=True, ignore_missing_fields=True)
        points.append(np.stack([np.asarray(scan[f"cartesian{axis}"], np.float64) for axis in "XYZ"], axis=1))
        if all(f"color{name}" in scan for name in ("Red", "Green", "Blue")):
            colors.append(
                np.stack([np.asarray(scan[f"color{n}"], np.float64) for n in ("Red", "Green", "Blue")], axis=1)
            )
    if not points:
        raise UserError("no scan in it")
    rgb = np.concatenate(colors) if len(colors) == count else None
    if rgb is not None:
        rgb = rgb / (255.0 if rgb.max() <= 255 else 65535.0)
    facts = Facts(taken=[f"{count} scan{'s' * (count != 1)}"])
    return finite_cloud(np.concatenate(points), None, rgb, facts)
