"""Tiny components at the surface are removed; components that are large or far away stay."""

import numpy as np
import trimesh

from mplicits.mesher.specks import without_specks
from mplicits.mesher.surface import Mesh

REACH = 0.05


def spheres(*places: tuple[float, float, int]) -> Mesh:
    """Spheres on the x axis, each of (center, radius, subdivisions of an icosahedron)."""
    parts: list[trimesh.Trimesh] = []
    for center, radius, subdivisions in places:
        part = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
        parts.append(part.apply_translation((center, 0, 0)))
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=True)]
    return Mesh(np.concatenate([part.vertices for part in parts], dtype=np.float32), np.concatenate(faces))


def test_a_tiny_component_at_the_surface_goes() -> None:
    mesh, count = without_specks(spheres((0, 0.5, 4), (0.52, 0.01, 1)), REACH)
    assert count == 1
    assert mesh.components()[0] == 1
    assert np.linalg.norm(mesh.vertices, axis=1).max() < 0.501


def test_large_components_and_far_ones_stay() -> None:
    shape = spheres((0, 0.5, 4), (0.52, 0.01, 3), (0.8, 0.01, 1), (0.56, 0.04, 1))
    mesh, count = without_specks(shape, REACH)
    assert count == 0
    np.testing.assert_array_equal(mesh.faces, shape.faces)


def test_a_mesh_of_specks_alone_stays() -> None:
    assert without_specks(spheres((0, 0.01, 1), (0.02, 0.01, 1)), REACH)[1] == 0
