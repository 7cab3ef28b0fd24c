"""Writes a small colored solid in the many ways in which programs write PLY, OBJ and text."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64) * (3, 2, 1)
QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
COLORS = np.round(np.random.default_rng(0).uniform(0, 1, (8, 3)) * 255) / 255
"""sRGB of the corners, multiples of 1/255."""
NAMES = {
    "colors": (
        *(("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue")),
        *(("Red", "Green", "Blue"), ("color_r", "color_g", "color_b"), ("Rf", "Gf", "Bf")),
    ),
    "normals": (
        ("nx", "ny", "nz"),
        ("normal_x", "normal_y", "normal_z"),
        ("Nx", "Ny", "Nz"),
        ("normalX", "normalY", "normalZ"),
    ),
}
SPELLED = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int", "u4": "uint"}


def normals_of(points: Doubles) -> Doubles:
    """Unit vectors away from the middle of points (N, 3)."""
    away = points - points.mean(axis=0)
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def faces(draw: st.DrawFn) -> list[tuple[int, ...]]:
    """Return the solid's faces: quads, some of them cut into triangles."""
    found: list[tuple[int, ...]] = []
    for quad in QUADS:
        found += [quad] if draw(st.booleans()) else [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    return found


@st.composite
def plys(draw: st.DrawFn) -> tuple[bytes, bool, bool]:
    """Draw a PLY of the solid. Returns it, and whether it has faces and colors."""
    line = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    form = draw(st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]))
    with_faces = draw(st.booleans())
    columns: list[tuple[str, str, Doubles]] = []
    place = draw(st.sampled_from(["f4", "f8"]))
    columns += [(name, place, column) for name, column in zip("xyz", CORNERS.T, strict=True)]
    if draw(st.booleans()) or not with_faces:
        names = draw(st.sampled_from(NAMES["normals"]))
        columns += [(n, "f4", c) for n, c in zip(names, normals_of(CORNERS).T, strict=True)]
    colored = draw(st.booleans())
    if colored:
        kind = draw(st.sampled_from(["u1", "u2", "f4", "f8"]))
        scale = {"u1": 255, "u2": 65535}.get(kind, 1)
        names = draw(st.sampled_from(NAMES["colors"]))
        columns += [(n, kind, c * scale) for n, c in zip(names, COLORS.T, strict=True)]
    if draw(st.booleans()):
        columns.append(("quality", "f4", np.arange(8.0)))
    if draw(st.booleans()):
        columns = [*columns[3:], *columns[:3]]
    lines = ["ply", f"format {form} 1.0", "comment made by a test", f"element vertex {len(CORNERS)}"]
    lines += [f"property {SPELLED[kind]} {name}" for name, kind, _ in columns]
    polygons = faces(draw) if with_faces else []
    index, count = draw(st.sampled_from(["i4", "u4"])), draw(st.sampled_from(["u1", "i4"]))
    flag = draw(st.booleans())
    if with_faces:
        lines.append(f"element face {len(polygons)}")
        lines += ["property uchar flags"] if flag else []
        name = draw(st.sampled_from(["vertex_indices", "vertex_index"]))
        lines.append(f"property list {SPELLED[count]} {SPELLED[index]} {name}")
    head = line.join([*lines, "end_header", ""]).encode()
    values = [column.astype(kind) for _, kind, column in columns]
    order = ">" if "big" in form else "<"
    body = b""
    if form == "ascii":
        rows = [" ".join(repr(c[k].item()) for c in values) for k in range(len(CORNERS))]
        rows += [" ".join(map(str, [*([7] if flag else []), len(p), *p])) for p in polygons]
        return head + line.join([*rows, ""]).encode(), with_faces, colored
    for k in range(len(CORNERS)):
        body += b"".join(np.array(c[k], order + c.dtype.str[1:]).tobytes() for c in values)
    for polygon in polygons:
        body += b"\x07" if flag else b""
        body += np.array(len(polygon), order + count).tobytes() + np.array(polygon, order + index).tobytes()
    return head + body, with_faces, colored


@st.composite
def objs(draw: st.DrawFn) -> tuple[bytes, bool]:
    """Draw an OBJ of the solid. Returns it, and whether it has colors."""
    colored, with_uv, with_normals = (draw(st.booleans()) for _ in range(3))
    negative, comments, continued = (draw(st.booleans()) for _ in range(3))
    lines = ["# made by a test", "o solid"]
    for point, color in zip(CORNERS, COLORS, strict=True):
        numbers = [*point, *(color if colored else ())]
        lines.append("v " + draw(st.sampled_from([" ", "  "])).join(f"{number:.9g}" for number in numbers))
    lines += ["vt 0.5 0.5"] * with_uv + ["vn 0 0 1"] * with_normals
    one = "-1" if negative else "1"
    ending = {(0, 0): "", (1, 0): f"/{one}", (0, 1): f"//{one}", (1, 1): f"/{one}/{one}"}[with_uv, with_normals]
    for face in faces(draw):
        words = [f"{corner - 8 if negative else corner + 1}{ending}" for corner in face]
        lines.append(("f " + (" \\\n  " if continued else " ").join(words)) + (" # a face" if comments else ""))
    text = "\n".join(lines) + "\n"
    return text.replace("\n", draw(st.sampled_from(["\n", "\r\n"]))).encode(), colored


@st.composite
def texts(draw: st.DrawFn, points: Doubles, colors: Doubles) -> tuple[bytes, bool, bool]:
    """Draw a text of points (N, 3) with unit normals and colors. Returns it, and whether it has normals and colors."""
    with_normals, colored, header, extra = (draw(st.booleans()) for _ in range(4))
    top = draw(st.sampled_from([1.0, 255.0, 65535.0]))
    blocks = [("x y z", points)]
    blocks += [("nx ny nz", normals_of(points))] if with_normals else []
    blocks += [("r g b", np.round(colors * top) if top > 1 else colors)] if colored else []
    if draw(st.booleans()):
        blocks = [blocks[0], *blocks[:0:-1]]
    if extra and header:
        blocks.append(("gps_time", np.arange(len(points), dtype=np.float64)[:, None]))
    separator = draw(st.sampled_from([" ", "\t", ",", ";", ", ", "   "]))
    names = separator.join(" ".join(name for name, _ in blocks).split())
    rows = [separator.join(f"{value:.9g}" for value in row) for row in np.concatenate([b for _, b in blocks], axis=1)]
    head = [draw(st.sampled_from(["", "#", "//"])) + names] if header else []
    if not header and draw(st.booleans()):
        head = [str(len(rows))]
    text = draw(st.sampled_from(["\n", "\r\n"])).join([*head, *rows, ""]).encode()
    return b"\xef\xbb\xbf" * draw(st.booleans()) + text, with_normals, colored
