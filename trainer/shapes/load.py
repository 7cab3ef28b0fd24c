"""Reading a shape from a file, or by the word `demo`."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ...model.errors import UserError
from ...model.files import show
from ...model.orientation import DEFAULT_UP, upright
from ...model.strips import mesh_of_strips
from .checks import FEWEST, check_cloud, check_coordinates
from .cloud import CloudShape
from .creases import CornerNormals
from .demo import DemoShape
from .duplicates import merge
from .image import ImageTexture, image_texture
from .mesh import MeshShape
from .orient import estimated_normals
from .points import Cloud, no_image, points_of_ply, read_npz, read_xyz
from .shape import Shape, SurfacePoints
from .sheet import SheetShape


@dataclass(frozen=True, eq=False)
class TexturedMesh:
    """A mesh as it was read, with its image."""

    mesh: trimesh.Trimesh
    texture: ImageTexture | None
    unwrapped: bool
    """Whether it has texture coordinates."""
    normals: CornerNormals | None
    """Of the file, at the faces' corners; None where it has none."""


def load_shape(
    name: str,
    image: Path | None = None,
    *,
    crease: float | None = None,
    noise: float | None = None,
    up: str = DEFAULT_UP,
    thicken: float | None = None,
) -> tuple[Shape, list[str]]:
    """Read a shape, and return it with the warnings for the user.

    name: a path, or `demo`. image: a file in place of the image of the mesh's material. crease: curve a mesh, but for
    edges that bend by more than this angle, degrees; None keeps its faces flat.
    noise: standard deviation of a cloud's points, as a share of the shape's radius; None: measured.
    up: the axis of the file that points up; the shape is turned so that y does. thicken: take an open mesh for a sheet,
    half of whose thickness is this share of its radius.

    Meshes: PLY, OBJ, STL, GLB. Point clouds: PLY without faces (x y z [nx ny nz] [red green blue]), XYZ (the same as
    text columns, colours 0 to 255), NPZ (arrays `points` [, `normals`] [, `colours` in 0 to 1]), OBJ without faces,
    and PLY of Gaussian splats. Where there are no normals, they are estimated.
    Raises UserError, one line, for everything that is none of these or cannot be used.
    """
    if name == "demo":
        if image is not None:
            raise UserError(f"--texture {show(image)}: the built-in shape has its own colours")
        if up != DEFAULT_UP:
            raise UserError(f"--up {up}: the built-in shape has {DEFAULT_UP} up")
        if thicken is not None:
            raise UserError("--thicken is for open sheets; the built-in shape is none")
        return DemoShape(), []
    path, label = Path(name), show(Path(name).name)
    if os.path.isdir(path):
        raise UserError(f"{show(name)}: a folder, not a file")
    if not os.path.isfile(path):
        raise UserError(f"{show(name)}: no such file")
    read = READERS.get(path.suffix.lower())
    if read is None:
        known = " ".join(suffix[1:].upper() for suffix in READERS)
        raise UserError(f"{label}: no shape format by that ending; this program reads {known}")
    try:
        source: dict[str, Any] = {"file": path.name, "sha256": _sha256(path)}
        content = read(path, image)
        if not isinstance(content, TexturedMesh):
            check_cloud(content.points, content.normals, content.colours)
    except UserError as error:
        raise UserError(f"{label}: {error}") from None
    except Exception as error:  # trimesh's and numpy's readers raise anything on damaged files
        reason = show(str(error).splitlines()[0] if str(error) else type(error).__name__)[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if image is not None:
        source["texture"] = {"file": image.name, "sha256": _sha256(image)}
    return shape_of_content(content, label, source, crease=crease, noise=noise, up=up, thicken=thicken)


def _sha256(path: Path) -> str:
    """Compute the SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def shape_of_content(
    content: TexturedMesh | Cloud,
    label: str,
    source: dict[str, Any],
    *,
    crease: float | None,
    noise: float | None,
    up: str,
    thicken: float | None,
) -> tuple[Shape, list[str]]:
    """Make the shape of what was read, or of what a program has in memory; the rest is as of `load_shape`.

    label: its name for people. source: what the provenance keeps of it, to which the options are added.
    """
    if up != DEFAULT_UP:
        source["up"] = up
        content = _turned(content, up)
    if isinstance(content, TexturedMesh):
        if noise:
            raise UserError(f"{label}: --noise is for point clouds; this is a mesh")
        if crease is not None:
            source["crease"] = crease
        given = content.mesh, label, source, content.texture
        shape: MeshShape | CloudShape
        if thicken is None:
            shape = MeshShape(*given, crease=crease, normals=content.normals)
        else:
            shape = SheetShape(*given, thickness=thicken, crease=crease, normals=content.normals)
        if content.texture is None and content.unwrapped:
            shape.warnings.append(f"{label}: texture coordinates, but no readable image; name it with --texture FILE")
    else:
        if thicken is not None:
            raise UserError(f"{label}: --thicken is for open sheets of triangles; this is a point cloud")
        shape, warnings = _cloud(content, label, source, noise)
        return shape, warnings + shape.warnings
    return shape, shape.warnings


def _cloud(cloud: Cloud, label: str, source: dict[str, Any], noise: float | None) -> tuple[CloudShape, list[str]]:
    """Make a shape of a cloud; where it has no normals, they are estimated, with a warning."""
    if cloud.normals is not None:
        return CloudShape(cloud.points, cloud.normals, cloud.colours, label, source, noise), []
    merged = merge(SurfacePoints(cloud.points, np.tile([0.0, 0.0, 1.0], (len(cloud.points), 1)), cloud.colours)).surface
    if len(merged.points) < FEWEST:
        raise UserError(f"{label}: {len(merged.points)} points at different places; a cloud needs at least {FEWEST}")
    normals, pieces = estimated_normals(merged.points)
    source["normals"] = "estimated"
    shown = "one piece" if pieces == 1 else f"{pieces:,} pieces"
    warning = f"{label}: no normals; estimated, and turned outwards in {shown}: look at the result"
    return CloudShape(merged.points, normals, merged.colours, label, source, noise), [warning]


def _turned(content: TexturedMesh | Cloud, up: str) -> TexturedMesh | Cloud:
    """Turn what was read so that the axis `up` becomes y."""
    if isinstance(content, TexturedMesh):
        content.mesh.vertices = upright(np.asarray(content.mesh.vertices, np.float64), up)
        given = content.normals
        return replace(content, normals=given and replace(given, values=upright(given.values, up)))
    normals = None if content.normals is None else upright(content.normals, up)
    return Cloud(upright(content.points, up), normals, content.colours)


def _read_mesh(path: Path, image: Path | None) -> TexturedMesh | Cloud:
    try:
        mesh = trimesh.load_mesh(path, process=False)
    except OSError:  # Of an image that is cut off. The mesh has no images then, about which there is a warning.
        mesh = trimesh.load_mesh(path, process=False, skip_materials=True)
        if isinstance(mesh.visual, trimesh.visual.TextureVisuals):
            material: Any = trimesh.visual.material.SimpleMaterial
            mesh.visual.material = material()
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        return _points_of(path, image)
    return textured(mesh, image)


def _points_of(path: Path, image: Path | None) -> Cloud:
    """Read the vertices of an OBJ without faces, and their colours. Raises UserError where there are none."""
    cloud: Any = trimesh.load(path, process=False)
    if not isinstance(cloud, trimesh.PointCloud) or not len(cloud.vertices):
        raise UserError("the mesh is empty; a shape needs triangles or points")
    no_image(image)
    colours = np.asarray(cloud.colors, np.float64)
    coloured = colours.shape[:1] == (len(cloud.vertices),) and colours.shape[1] >= 3
    return Cloud(np.asarray(cloud.vertices, np.float64), None, colours[:, :3] / 255 if coloured else None)


def textured(mesh: trimesh.Trimesh, image: Path | None) -> TexturedMesh:
    """Read the texture of a mesh, then merge the vertices at one place that differ by coordinates or normals only."""
    check_coordinates(np.asarray(mesh.vertices, np.float64))
    texture = image_texture(mesh, image)
    # trimesh computes normals where the file has none; those of the file are in its cache from the start.
    normals = None
    if "vertex_normals" in mesh._cache:
        normals = CornerNormals(np.asarray(mesh.vertex_normals, np.float64), np.array(mesh.faces))
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return TexturedMesh(mesh, texture, isinstance(mesh.visual, trimesh.visual.TextureVisuals), normals)


def _read_ply(path: Path, image: Path | None) -> TexturedMesh | Cloud:
    loaded: Any = trimesh.load(path, process=False)
    mesh = loaded if isinstance(loaded, trimesh.Trimesh) and len(loaded.faces) else mesh_of_strips(loaded)
    if mesh is not None:
        loaded.metadata.pop("_ply_raw", None)  # the whole file once more
        return textured(mesh, image)
    no_image(image)
    return points_of_ply(loaded.metadata.get("_ply_raw", {}).get("vertex", {}).get("data", {}))


READERS: dict[str, Callable[[Path, Path | None], TexturedMesh | Cloud]] = {
    ".ply": _read_ply,
    ".obj": _read_mesh,
    ".stl": _read_mesh,
    ".glb": _read_mesh,
    ".xyz": read_xyz,
    ".npz": read_npz,
}
