"""Meshes of benchmarks/peers.py: the true surface as a mesh, simplified by quadrics, and coded by Draco and meshopt."""

import gzip
import tempfile
from dataclasses import dataclass
from pathlib import Path

import DracoPy
import meshoptimizer
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mplicits.readers.values import Doubles, Integers
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.creases import corner_normals
from mplicits.trainer.shapes.mesh import MeshShape
from mplicits.trainer.shapes.shape import unit
from peers_surface import Paint, Surface

DECIMALS = 7
"""Vertices that agree to this number of decimals, in model space, are one."""
NORMAL_BITS = 7
"""Bits of each of the two numbers of a normal in Draco's files."""
UV_BITS = 11
"""Bits of each texture coordinate."""
LARGEST_NORMAL, LARGEST_UV = 127, (1 << UV_BITS) - 1
"""Largest whole numbers in meshopt's files."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A mesh in model space."""

    vertices: Doubles
    """(V, 3)."""
    faces: Integers
    """(F, 3)."""
    uv: Doubles | None = None
    """(F, 3, 2), texture coordinates at the corners, v upwards; None without a texture."""
    normals: Doubles | None = None
    """(F, 3, 3), unit normals at the corners; None where they are to be computed."""

    def welded(self) -> "Triangles":
        """Merge vertices at one place, and drop faces that then have two equal corners."""
        _, first, index = np.unique(self.vertices.round(DECIMALS), axis=0, return_index=True, return_inverse=True)
        faces = index.reshape(-1)[self.faces]
        whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        uv, normals = (None if corners is None else corners[whole] for corners in (self.uv, self.normals))
        return Triangles(self.vertices[first], faces[whole], uv, normals)

    def split(self) -> tuple[Doubles, Integers, Doubles | None]:
        """Return vertices (N, 3), faces (F, 3), and texture coordinates (N, 2): a vertex for each pair of both."""
        if self.uv is None:
            return self.vertices, self.faces, None
        pairs = np.concatenate((self.faces.reshape(-1, 1), self.uv.reshape(-1, 2)), axis=1)
        unique, index = np.unique(pairs, axis=0, return_inverse=True)
        places = self.vertices[unique[:, 0].astype(np.int64)]
        return places, index.reshape(-1, 3).astype(np.int64), np.asarray(unique[:, 1:], np.float64)

    def surface(self, paint: Paint | None = None) -> Surface:
        """Return the surface. Computed normals are smooth, except for creases, as `mplicits train` computes them."""
        normals = self.normals
        if normals is None:
            normals = corner_normals(self.vertices, self.faces, CREASE)[:]
        return Surface(self.vertices, self.faces, normals, paint)


@dataclass(frozen=True, eq=False)
class Coded:
    """A coded mesh."""

    size: int
    """Bytes."""
    decoded: Triangles
    """What a decoder makes of them."""


def of_shape(shape: MeshShape) -> Triangles:
    """Return the true surface: the facets that `mplicits train` learns, with their normals."""
    facets, uv = shape._facets, None
    if shape._paint is not None and shape._paint.uv is not None:
        uv = np.einsum("fck,fki->fci", facets.weights, shape._paint.uv[facets.parents])
    return Triangles(facets.vertices, facets.faces, uv, facets.normals[:]).welded()


def of_file(shape: MeshShape) -> Triangles:
    """Return the mesh of the shape's file, in model space."""
    uv = None if shape._paint is None or shape._paint.uv is None else shape._paint.uv[:]
    return Triangles(shape.inputs(), shape._corners, uv).welded()


def simplified(mesh: Triangles, faces: int) -> Triangles:
    """Simplify by quadrics (Garland and Heckbert 1997), by MeshLab's code, which keeps texture coordinates."""
    import pymeshlab

    work = pymeshlab.MeshSet()
    if mesh.uv is None:
        work.add_mesh(pymeshlab.Mesh(vertex_matrix=mesh.vertices, face_matrix=mesh.faces.astype(np.int32)))
        work.meshing_decimation_quadric_edge_collapse(targetfacenum=faces)
    else:
        with tempfile.TemporaryDirectory() as folder:
            work.load_new_mesh(str(_textured(mesh, Path(folder))))
        work.meshing_decimation_quadric_edge_collapse_with_texture(targetfacenum=faces)
    result = work.current_mesh()
    result.compact()
    uv = None if mesh.uv is None else result.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    return Triangles(result.vertex_matrix(), result.face_matrix().astype(np.int64), uv).welded()


def _textured(mesh: Triangles, folder: Path) -> Path:
    """Write an OBJ file, the only way to give MeshLab's code a textured mesh. The texture is one pixel."""
    assert mesh.uv is not None
    corners = 1 + np.arange(mesh.faces.size).reshape(-1, 3)
    Image.new("RGB", (1, 1)).save(folder / "skin.png")
    (folder / "mesh.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    with (folder / "mesh.obj").open("w") as file:
        file.write("mtllib mesh.mtl\nusemtl skin\n")
        np.savetxt(file, mesh.vertices, "v %.8f %.8f %.8f")
        np.savetxt(file, mesh.uv.reshape(-1, 2), "vt %.7f %.7f")
        np.savetxt(file, np.stack((1 + mesh.faces, corners), axis=2).reshape(-1, 6), "f %d/%d %d/%d %d/%d")
    return folder / "mesh.obj"


def draco(mesh: Triangles, bits: int, truth: Surface | None = None) -> Coded:
    """Code by Draco, level 10. bits: of a coordinate. truth: gives the normals to store; None: store none."""
    vertices, faces, uv = mesh.split()
    data = DracoPy.encode(
        vertices.astype(np.float32),
        faces.astype(np.uint32),
        quantization_bits=bits,
        compression_level=10,
        tex_coord=uv,
        normals=None if truth is None else truth.nearest(vertices).normals,
        tex_coord_quantization_bits=UV_BITS,
        normal_quantization_bits=NORMAL_BITS,
    )
    found = DracoPy.decode(data)
    at = np.asarray(found.faces, np.int64)
    normals = None if truth is None else unit(np.asarray(found.normals, np.float64))[at]
    texture = None if uv is None else np.asarray(found.tex_coord, np.float64)[at]
    return Coded(len(data), Triangles(np.asarray(found.points, np.float64), at, texture, normals).welded())


def meshopt(mesh: Triangles, bits: int, truth: Surface | None = None) -> Coded:
    """Quantize, code by meshopt, and pack by gzip, as gltfpack and a web server do. Arguments as of `draco`."""
    vertices, faces, uv = mesh.split()
    lowest, side = vertices.min(axis=0), np.ptp(vertices, axis=0).max() / ((1 << bits) - 1)
    columns: list[NDArray[np.uint8]] = [_rows(np.rint((vertices - lowest) / side), np.uint16)]
    if truth is not None:
        columns.append(_rows(np.rint(truth.nearest(vertices).normals * LARGEST_NORMAL), np.int8))
    if uv is not None:
        corner, extent = uv.min(axis=0), np.ptp(uv, axis=0).max() / LARGEST_UV
        columns.append(_rows(np.rint((uv - corner) / extent), np.uint16))
    rows = np.ascontiguousarray(np.concatenate(columns, axis=1))
    order = np.empty(faces.size, np.uint32)
    meshoptimizer.optimize_vertex_cache(order, faces.astype(np.uint32).ravel(), faces.size, len(vertices))
    used = np.empty_like(rows)
    meshoptimizer.optimize_vertex_fetch(used, order, rows, faces.size, len(rows), rows.shape[1])
    data = meshoptimizer.encode_vertex_buffer(used, len(used), rows.shape[1])
    indices = meshoptimizer.encode_index_buffer(order, faces.size, len(used))
    size = len(gzip.compress(bytes(data) + bytes(indices), 9, mtime=0))
    back = np.asarray(meshoptimizer.decode_vertex_buffer(len(used), rows.shape[1], data)).view(np.uint8)
    back = back.reshape(len(used), -1)
    at = np.asarray(meshoptimizer.decode_index_buffer(faces.size, 4, indices)).astype(np.int64).reshape(-1, 3)
    places = back[:, :8].copy().view(np.uint16)[:, :3] * side + lowest
    normals, texture = None, None
    if truth is not None:
        normals = unit(back[:, 8:12].copy().view(np.int8)[:, :3].astype(np.float64))[at]
    if uv is not None:
        texture = (back[:, -4:].copy().view(np.uint16) * extent + corner)[at]
    return Coded(size, Triangles(places, at, texture, normals).welded())


def _rows(numbers: Doubles, kind: type[np.integer]) -> NDArray[np.uint8]:
    """Return the bytes (N, B) of numbers (N, K), with zeros up to a multiple of four."""
    whole = numbers.astype(kind)
    data = whole.view(np.uint8).reshape(len(whole), -1)
    return np.pad(data, ((0, 0), (0, -data.shape[1] % 4)))
