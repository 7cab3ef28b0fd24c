"""Adaptive samples of a pixel, by its difference from its neighbors, for the viewer and the page."""

SHARE = 0.15
"""Largest mean number of samples of a pixel of the shape, as a share of the most samples of a pixel."""
ROUGH_SHARE = 0.25
"""The same share for a picture of many edges, in which SHARE would give fewer than FEW samples to a difference of 1."""
FEW = 6.0
"""Number of further samples, for a difference of 1 between neighboring pixels, that counts as few."""
POWER = 2 / 3
"""The number of a pixel's further samples grows with this power of its difference from its neighbors.

The variance of a mean of k samples in a pixel falls like k^-1.7 (Lucy, 128 pixels a side). So the error of a picture is
smallest for the work if k^2.7 follows the variance.
"""
STEEPEST = 40.0
"""Most further samples for a difference of 1 between neighboring pixels, where the shape has few edges."""
BLOCK = 4
"""Side of the squares of pixels that drivers on a CPU draw at once: each holds samples that are close together."""
