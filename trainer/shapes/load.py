"""Loads a shape: from a file, from arrays, or the demo shape."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np

from ...model.errors import UserError
from ...model.files import is_file, is_folder, show
from ...model.orientation import DEFAULT_UP, upright
from .arrays import Arrays, content_of
from .checks import check_cloud, check_count, name_first
from .cloud import CloudShape
from .cloud_files import Cloud, read_npz, read_xyz
from .demo import DemoShape
from .duplicates import merge
from .mesh import MeshShape
from .mesh_files import TexturedMesh, read_mesh, read_ply
from .orient import estimated_normals
from .shape import Shape, SurfacePoints
from .sheet import SheetShape

READERS: dict[str, Callable[[Path, Path | None], TexturedMesh | Cloud]] = {
    ".ply": read_ply,
    ".obj": read_mesh,
    ".stl": read_mesh,
    ".glb": read_mesh,
    ".xyz": lambda path, _: read_xyz(path),
    ".npz": lambda path, _: read_npz(path),
}


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
    shape: str | Path | Arrays, image: Path | None = None, **options: Unpack[ShapeOptions]
) -> tuple[Shape, list[str]]:
    """Load a shape. Returns it with warnings for the user.

    shape: a path, "demo", or arrays. image: replaces the image of the mesh's material.

    Meshes: PLY, OBJ, STL, GLB. Point clouds: PLY without faces (x y z [nx ny nz] [red green blue]), XYZ (the same as
    text columns), NPZ (arrays `points` [, `normals`] [, `colors` in 0 to 1]), OBJ without faces, and PLY of Gaussian
    splats. Missing normals are estimated. Raises UserError for every other input.
    """
    if not isinstance(shape, str | Path):
        with name_first("arrays"):
            content, digest = content_of(shape)
        return _shape_of(content, "arrays", {"sha256": digest}, **options)
    if shape == "demo":
        return _demo(image, **options)
    path, label = Path(shape), show(Path(shape).name)
    if is_folder(path):
        raise UserError(f"{show(path)}: a folder, not a file")
    if not is_file(path):
        raise UserError(f"{show(path)}: no such file")
    read = READERS.get(path.suffix.lower())
    if read is None:
        known = " ".join(suffix[1:].upper() for suffix in READERS)
        raise UserError(f"{label}: unknown shape format; this program reads {known}")
    try:
        source: dict[str, Any] = {"file": path.name, "sha256": _sha256(path)}
        with name_first(label):
            content = read(path, image)
    except UserError:
        raise
    except Exception as error:  # readers of trimesh and numpy raise anything on damaged files
        reason = show(str(error).splitlines()[0] if str(error) else type(error).__name__)[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if image is not None:
        if isinstance(content, Cloud):
            raise UserError(f"{label}: --texture {show(image)}: a point cloud has no texture coordinates")
        source["texture"] = {"file": image.name, "sha256": _sha256(image)}
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
    content: TexturedMesh | Cloud,
    label: str,
    source: dict[str, Any],
    *,
    crease: float | None = None,
    noise: float | None = None,
    up: str = DEFAULT_UP,
    thicken: float | None = None,
) -> tuple[Shape, list[str]]:
    """Make the shape of a mesh or a cloud. label: its name in messages. source: provenance; options are added."""
    if isinstance(content, Cloud):
        with name_first(label):
            check_cloud(content.points, content.normals, content.colors)
    if up != DEFAULT_UP:
        source["up"] = up
        content = _upright(content, up)
    if isinstance(content, Cloud):
        if thicken is not None:
            raise UserError(f"{label}: --thicken is for open sheets of triangles; this is a point cloud")
        return _cloud(content, label, source, noise)
    if noise:
        raise UserError(f"{label}: --noise is for point clouds; this is a mesh")
    if crease is not None:
        source["crease"] = crease
    arguments = content.mesh, label, source, content.texture
    if thicken is None:
        shape = MeshShape(*arguments, crease=crease, normals=content.normals)
    else:
        shape = SheetShape(*arguments, thickness=thicken, crease=crease, normals=content.normals)
    if content.texture is None and content.unwrapped:
        shape.warnings.append(f"{label}: texture coordinates, but no readable image; name it with --texture FILE")
    return shape, shape.warnings


def _cloud(cloud: Cloud, label: str, source: dict[str, Any], noise: float | None) -> tuple[CloudShape, list[str]]:
    """Make a shape of a cloud; estimate missing normals, with a warning."""
    warnings = []
    normals = cloud.normals
    if normals is None:
        unoriented = SurfacePoints(cloud.points, np.tile([0.0, 0.0, 1.0], (len(cloud.points), 1)), cloud.colors)
        merged = merge(unoriented).surface
        with name_first(label):
            check_count(len(merged.points), "points at different places")
        normals, components = estimated_normals(merged.points)
        cloud = Cloud(merged.points, normals, merged.colors)
        source["normals"] = "estimated"
        parts = "one component" if components == 1 else f"{components:,} components"
        warnings = [f"{label}: no normals; estimated, and oriented outwards in {parts}: check the result"]
    shape = CloudShape(SurfacePoints(cloud.points, normals, cloud.colors), label, source, noise)
    return shape, warnings + shape.warnings


def _upright(content: TexturedMesh | Cloud, up: str) -> TexturedMesh | Cloud:
    """Rotate a mesh or a cloud so that its axis `up` becomes y."""
    if isinstance(content, Cloud):
        turned = None if content.normals is None else upright(content.normals, up)
        return Cloud(upright(content.points, up), turned, content.colors)
    content.mesh.vertices = upright(np.asarray(content.mesh.vertices, np.float64), up)
    return replace(
        content, normals=content.normals and replace(content.normals, values=upright(content.normals.values, up))
    )
