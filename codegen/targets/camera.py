"""Axes and distance of the orbit camera, for the viewer and for the page's poster."""

import math

import numpy as np
from numpy.typing import NDArray

from .orbit import MARGIN


def basis(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return the axes of a camera in model space: (3, 3), columns right, up and back.

    azimuth: degrees around the y axis, 0 on +z and 90 on +x. elevation: degrees above the xz plane.
    """
    a, e = math.radians(azimuth), math.radians(elevation)
    return np.array(
        [
            [math.cos(a), -math.sin(e) * math.sin(a), math.cos(e) * math.sin(a)],
            [0.0, math.cos(e), math.sin(e)],
            [-math.sin(a), -math.sin(e) * math.cos(a), math.cos(e) * math.cos(a)],
        ]
    )


def fitting_distance(aspect: float, focal: float) -> float:
    """Return the distance at which the unit sphere fits the picture, model units.

    aspect: width / height of the picture. focal: distance of the picture plane that spans -1 to 1 vertically.
    """
    return MARGIN / math.sin(math.atan(min(1.0, aspect) / focal))
