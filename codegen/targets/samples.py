"""How further samples of a pixel follow its difference from its neighbours: what the viewer and the page share."""

SHARE = 0.2
"""Of all samples that a pixel may have, so many are taken by a pixel of the shape, at most, in the mean."""
STEEPEST = 64.0
"""Further samples, for a difference of 1 between neighbouring pixels, where the shape has few edges."""
BLOCK = 4
"""Side of the squares of pixels that drivers on a CPU draw at once: each holds samples that lie close together."""
