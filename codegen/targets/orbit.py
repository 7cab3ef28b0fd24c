"""Default numbers of the orbit camera, for the viewer and the web page."""

AZIMUTH = 30.0
"""Initial azimuth, degrees around the y axis: 0 looks from +z, 90 from +x."""
ELEVATION = 20.0
"""Initial elevation, degrees above the xz plane."""
FOV = 35.0
"""Initial vertical field of view, degrees."""
MARGIN = 1.06
"""Radius of the sphere that fits the picture at the default distance: the unit sphere and a margin."""
ZOOM = (0.05, 100.0)
"""Smallest and largest distance from the target, model units."""
