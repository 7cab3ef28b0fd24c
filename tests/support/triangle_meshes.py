"""Small triangle meshes in model space."""

import numpy as np

from mplicits.viewer.draw.triangles import Triangles

SQUARE = Triangles(
    np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], np.float32),
    np.tile(np.array((0, 0, 2), np.float32), (4, 1)),
    np.array([(0, 1, 2), (0, 2, 3)], np.int32),
)
