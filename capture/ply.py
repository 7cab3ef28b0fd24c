"""Writes a point cloud as a PLY file."""

import numpy as np

from .unproject import Cloud


def to_ply(cloud: Cloud) -> bytes:
    """Return the bytes of a binary PLY file: x y z nx ny nz [red green blue], one vertex for each point."""
    fields = [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
    if cloud.colours is not None:
        fields += [(name, "u1") for name in ("red", "green", "blue")]
    table = np.empty(len(cloud.points), fields)
    for names, columns in ((("x", "y", "z"), cloud.points), (("nx", "ny", "nz"), cloud.normals)):
        for name, column in zip(names, columns.T, strict=True):
            table[name] = column
    if cloud.colours is not None:
        for name, column in zip(("red", "green", "blue"), cloud.colours.T, strict=True):
            table[name] = column
    words = {"<f4": "float", "u1": "uchar"}
    properties = "".join(f"property {words[kind]} {name}\n" for name, kind in fields)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n{properties}end_header\n"
    return head.encode() + table.tobytes()
