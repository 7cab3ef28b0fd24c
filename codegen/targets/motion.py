"""Playback of a moving model: from time 0 to 1 and back, slower at both ends, in every target and in videos."""

import math

PERIOD = 2 * math.pi
"""Seconds of one period, there and back."""


def time_at_phase(phase: float) -> float:
    """Return the time, from 0 to 1, at a share of the period: 0 at 0, 1 at a half, 0 again at 1."""
    return 0.5 - 0.5 * math.cos(2 * math.pi * phase)


def phase_at_time(time: float) -> float:
    """Return the share of the period, at most a half, at which a time is reached: the inverse of `time_at_phase`."""
    return math.acos(1.0 - 2.0 * time) / (2 * math.pi)
