"""How further samples of a pixel follow its difference from its neighbours: what the viewer and the page share."""

SHARE = 0.15
"""Of all samples that a pixel may have, so many are taken by a pixel of the shape, at most, in the mean."""
ROUGH_SHARE = 0.25
"""The same where nearly all pixels are at an edge: as long as few are taken for a difference of 1."""
FEW = 6.0
"""Further samples, for a difference of 1 between neighbouring pixels, that are few."""
POWER = 2 / 3
"""Of a pixel's difference from its neighbours, that the number of its further samples follows.

The variance of a mean of k samples that are spread over a pixel falls like k^-1.7 (Lucy, 128 pixels a side): the
error of a picture is least for the work where k^2.7 follows the variance.
"""
STEEPEST = 40.0
"""Further samples, for a difference of 1 between neighbouring pixels, where the shape has few edges."""
BLOCK = 4
"""Side of the squares of pixels that drivers on a CPU draw at once: each holds samples that lie close together."""
