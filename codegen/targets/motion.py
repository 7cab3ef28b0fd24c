"""How a model that moves is played: from time 0 to 1 and back, slower at both ends, for as long as one looks.

Shadertoy's text, the page, the window and videos do it alike.
"""

import math

PERIOD = 2 * math.pi
"""Seconds of the way there and back."""


def time_at_phase(phase: float) -> float:
    """Return the time, from 0 to 1, at a share of the way there and back: 0 at 0, 1 at a half, 0 again at 1."""
    return 0.5 - 0.5 * math.cos(2 * math.pi * phase)


def phase_at_time(time: float) -> float:
    """Return the share of the way, at most a half, at which a time from 0 to 1 is reached: the inverse of `moment`."""
    return math.acos(1.0 - 2.0 * time) / (2 * math.pi)
