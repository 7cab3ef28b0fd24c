"""Loads a shape: from a file, from arrays, or the demo shape."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np

from ...model.errors import UserError
from ...model.files import show
from ...model.orientation import DEFAULT_UP, upright
from ...readers.column_names import parse_columns
from ...readers.content import Cloud, Mesh
from ...readers.read import read_shape
from ...readers.tidy import tidy
from .arrays import Arrays, content_of
from .checks import check_cloud, check_coordinates, check_count, name_first
from .cloud import CloudShape
from .cloud_facing import turned_outward
from .demo import DemoShape
from .duplicates import merge
from .mesh import MeshShape
from .orient import estimated_normals
from .reading_report import ReadingReport, taken_of
from .shape import Shape, SurfacePoints
from .sheet import SheetShape


class ShapeOptions(TypedDict, total=False):
    """How to interpret an input."""

    crease: float | None
    """Curve a mesh, but keep edges sharp that bend by more than this angle, degrees; None: flat faces."""
    noise: float | None
    """Standard deviation of a cloud's points, as a share of the shape's radius; None: measure it."""
    up: str
    """Axis of the input that points up; it becomes the y axis of model space."""
    thicken: float | None
    """Treat an open mesh as a sheet; half its thickness, as a share of its radius."""


def load_shape(
    shape: str | Path | Arrays,
    image: Path | None = None,
    columns: str | Sequence[str] | None = None,
    *,
    follow: bool = False,
    **options: Unpack[ShapeOptions],
) -> tuple[Shape, list[str]]:
    """Load a shape. Returns it with warnings for the user; `Shape.taken` says what was taken.

    shape: a path, "demo", or arrays. image: replaces the image of the mesh's material. columns: roles of a cloud's
    columns, "x,y,z,nx,ny,nz,r,g,b"; None: by their names, or by their lengths and ranges. follow: whether
    the file may name files outside of its folder.

    Meshes: PLY, OBJ, STL, GLB, glTF, OFF, 3MF. Point clouds: PLY and OBJ without faces, text columns (XYZ, CSV, TXT,
    ASC, PTS), NPZ, PCD, LAS, LAZ, E57, and PLY of Gaussian splats. Missing normals are estimated. Raises UserError for
    every other input.
    """
    chosen = parse_columns(columns)
    if not isinstance(shape, str | Path):
        with name_first("arrays"):
            content, digest = content_of(shape, chosen)
        return _shape_of(content, "arrays", {"sha256": digest}, **options)
    if shape == "demo":
        return _demo(image, **options)
    path, label = Path(shape), show(Path(shape).name)
    content = read_shape(path, image, chosen, follow=follow)
    source: dict[str, Any] = {"file": path.name, "sha256": _sha256(path)}
    if image is not None:
        source["texture"] = {"file": image.name, "sha256": _sha256(image)}
    if chosen is not None:
        source["columns"] = list(chosen)
    return _shape_of(content, label, source, **options)


def _demo(image: Path | None, **options: Unpack[ShapeOptions]) -> tuple[Shape, list[str]]:
    if image is not None:
        raise UserError(f"--texture {show(image)}: the demo shape has its own colors")
    if options.get("up", DEFAULT_UP) != DEFAULT_UP:
        raise UserError(f"--up {options['up']}: in the demo shape, {DEFAULT_UP} points up")
    if options.get("thicken") is not None:
        raise UserError("--thicken is for open sheets; the demo shape is closed")
    return DemoShape(), []


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _shape_of(
    content: Mesh | Cloud,
    label: str,
    source: dict[str, Any],
    *,
    crease: float | None = None,
    noise: float | None = None,
    up: str = DEFAULT_UP,
    thicken: float | None = None,
) -> tuple[Shape, list[str]]:
    """Make the shape of a mesh or a cloud. label: its name in messages. source: provenance; options are added."""
    with name_first(label):
        if isinstance(content, Cloud):
            check_cloud(content.points, content.normals, content.colors)
        else:
            check_coordinates(content.vertices)
            content = tidy(content)
    if up != DEFAULT_UP:
        source["up"] = up
        content = _upright(content, up)
    said = [f"{label}: {line}" for line in content.facts.warnings]
    if isinstance(content, Cloud):
        if thicken is not None:
            raise UserError(f"{label}: --thicken is for open sheets of triangles; this is a point cloud")
        shape, warnings, taken = _cloud(content, label, source, noise, up)
        shape.taken = taken
        return shape, said + warnings
    if noise:
        raise UserError(f"{label}: --noise is for point clouds; this is a mesh")
    if crease is not None:
        source["crease"] = crease
    solid = (
        MeshShape(content, label, source, crease=crease)
        if thicken is None
        else SheetShape(content, label, source, thickness=thicken, crease=crease)
    )
    facing = solid.facing
    solid.taken = taken_of(
        content,
        label,
        up,
        parts=facing.parts,
        turned=0 if thicken else facing.turned,
        creases=0.0 if thicken else solid.creases,
    )
    solid.warnings = said + solid.warnings
    return solid, solid.warnings


def _cloud(
    cloud: Cloud, label: str, source: dict[str, Any], noise: float | None, up: str
) -> tuple[CloudShape, list[str], ReadingReport]:
    """Make a shape of a cloud; estimate missing normals, and turn those that point inward, with a warning."""
    estimated, warnings, turned = cloud.normals is None, list[str](), 0
    if cloud.normals is None:
        unoriented = SurfacePoints(cloud.points, np.tile([0.0, 0.0, 1.0], (len(cloud.points), 1)), cloud.colors)
        merged = merge(unoriented).surface
        with name_first(label):
            check_count(len(merged.points), "points at different places")
        normals, components = estimated_normals(merged.points)
        cloud = Cloud(merged.points, normals, merged.colors, cloud.facts)
        source["normals"] = "estimated"
        parts = "one component" if components == 1 else f"{components:,} components"
        warnings.append(f"{label}: no normals; estimated, and oriented outwards in {parts}: check the result")
    else:
        normals, turned, parts_found = turned_outward(cloud.points, cloud.normals)
        cloud = replace(cloud, normals=normals)
        if turned:
            which = "the normals" if turned == parts_found else f"the normals of {turned} of {parts_found} parts"
            warnings.append(f"{label}: {which} point inwards; turned round")
    assert cloud.normals is not None
    shape = CloudShape(SurfacePoints(cloud.points, cloud.normals, cloud.colors), label, source, noise)
    taken = taken_of(cloud, label, up, parts=0, turned=turned, estimated=estimated)
    return shape, warnings + shape.warnings, taken


def _upright(content: Mesh | Cloud, up: str) -> Mesh | Cloud:
    """Rotate a mesh or a cloud so that its axis `up` becomes y."""
    if isinstance(content, Cloud):
        turned = None if content.normals is None else upright(content.normals, up)
        return replace(content, points=upright(content.points, up), normals=turned)
    normals = content.normals and replace(content.normals, values=upright(content.normals.values, up))
    return replace(content, vertices=upright(content.vertices, up), normals=normals)
