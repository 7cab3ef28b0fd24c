"""Specks: tiny components at the surface, which the network's last ripples make and which no shape means."""

import numpy as np
from scipy.spatial import cKDTree

from .surface import Mesh

LARGEST = 100
"""Number of triangles from which on a component is no speck."""


def without_specks(mesh: Mesh, reach: float) -> tuple[Mesh, int]:
    """Remove the components of fewer than `LARGEST` triangles within `reach`, model units, of a larger component.

    Returns the mesh and the number of removed components.
    """
    count, component = mesh.components()
    small = np.bincount(component[mesh.faces[:, 0]], minlength=count) < LARGEST
    if small.all() or not small.any():
        return mesh, 0
    suspects = small[component]
    distance, _ = cKDTree(mesh.vertices[~suspects]).query(mesh.vertices[suspects], distance_upper_bound=reach)
    far = np.zeros(count, np.bool_)
    np.logical_or.at(far, component[suspects], distance > reach)  # the distance is infinite beyond the bound
    specks = small & ~far
    return mesh.only(~specks[component]), int(specks.sum())
