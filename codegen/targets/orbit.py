"""Numbers of the orbit camera that the viewer and the web page share."""

AZIMUTH = 30.0
"""The first view's degrees around the y axis: 0 looks from +z, 90 from +x."""
ELEVATION = 20.0
"""The first view's degrees above the xz plane."""
FOV = 35.0
"""The first view's vertical field of view, degrees."""
MARGIN = 1.06
"""The default distance shows a sphere of this radius: the unit sphere and some air."""
ZOOM = (0.05, 100.0)
"""The least and the largest distance from the target that zooming leads to, model units."""
