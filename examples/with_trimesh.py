"""Evaluate a model at the vertices of a trimesh, trace rays, and return a trimesh."""

import numpy as np
import trimesh

import mplicits

spot = mplicits.load("spot")
box = trimesh.creation.box((1, 1, 1)).subdivide_loop(2)
distance = spot(box.vertices)
print(f"{(distance < 0).mean():.0%} of the box's vertices are inside, the farthest is {distance.max():.2f} away")

hits = spot.trace(box.vertices * 3, -box.vertices)
print(f"{hits.hit.mean():.0%} of the rays from around meet Spot, after {np.mean(hits.t[hits.hit]):.2f} on average")

mesh = spot.mesh(64, quiet=True).to_trimesh()
print(f"Spot has {len(mesh.faces):,} triangles, a volume of {mesh.volume:.3f}, and is closed: {mesh.is_watertight}")
