"""Adaptive samples of a pixel, by its difference from its neighbors, for the viewer and the page."""

SHARE = 0.1
"""Largest mean number of further samples of a pixel of the shape, as a share of the most further samples of a pixel."""
PLENTY = 8.0
"""Number of further samples, for a difference of 1 between neighboring pixels, from which on SHARE holds.

A picture of many edges, such as a small one, may have more where that leaves k < PLENTY: SHARE times (PLENTY / k)^2.
"""
POWER = 2 / 3
"""The number of a pixel's further samples grows with this power of its difference from its neighbors.

The variance of a mean of k samples in a pixel falls like k^-1.7 (Lucy, 128 pixels a side). So the error of a picture is
smallest for the work if k^2.7 follows the variance.
"""
STEEPEST = 40.0
"""Most further samples for a difference of 1 between neighboring pixels, where the shape has few edges."""
BLOCK = 4
"""Side of the squares of pixels that drivers on a CPU draw at once: each holds samples that are close together."""
