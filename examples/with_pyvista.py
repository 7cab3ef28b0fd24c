"""Contour a model on a PyVista grid, in the model's own colors."""

import numpy as np
import pyvista

import mplicits

spot = mplicits.load("spot")
grid = pyvista.ImageData(dimensions=(65, 65, 65), spacing=(2 / 64,) * 3, origin=(-1, -1, -1))
grid["distance"] = spot(np.asarray(grid.points))
surface = grid.contour([0.0], scalars="distance")
surface["color"] = spot.color(np.asarray(surface.points))
surface.save("spot.vtp")
print(f"{surface.n_points:,} points, {surface.n_cells:,} triangles")
