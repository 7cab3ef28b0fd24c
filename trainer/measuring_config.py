"""Hyperparameters of what is measured of trained levels; config.py has the others, and their units."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TracingConfig:
    """Rays along which the longest safe steps of sphere tracing are measured."""

    rays: int = 1024
    """First rays aimed at the surface, and as many from points in the ball to the surface."""
    rounds: int = 3
    """Rounds that follow rays like the worst ones of the round before."""
    worst: int = 256
    """Worst rays of a round, for each level."""
    aside: float = 0.005
    """Standard deviation of a ray's distance from its aim."""
    turn: float = 0.05
    """Standard deviation of a ray's turn, radians."""
    inside: float = 0.25
    """Share of the first stretch inside the shape that a step may reach; other rays may find the shape thinner."""
    step_share: float = 0.7
    """Step between samples, as a share of the field's value, limited by the next two."""
    shortest: float = 0.001
    longest: float = 0.05
    samples: int = 200
    """Most samples of a ray."""
    expected_samples: int = 100
    """Usual samples of a ray, for the estimate of the time."""
    gradient_every: int = 8
    """The gradient is measured at one of this many samples."""
    least_bound: float = 0.5
    """Least bound: a field that needs shorter steps is broken, and would only trace more slowly."""


@dataclass(frozen=True)
class ComparingConfig:
    """Samples of the surfaces whose distance is measured at the end of a training."""

    lines: int = 16_384
    """Random lines whose crossings are samples of the field's surface."""
    along: TracingConfig = TracingConfig()
    """Steps along the lines."""
    expected_samples: int = 60
    """Usual steps along a line, for the estimate of the time."""
    points: int = 20_000
    """Held-out points of the shape's surface."""


@dataclass(frozen=True)
class MeasuringConfig:
    """Points at which trained levels are measured."""

    points: int = 100_000
    """Held-out surface points."""
    band_points: int = 200_000
    """Further surface points of Eq. 5, beside the held-out points and the input's own."""
    lipschitz_points: int = 100_000
    """Points of the largest gradient; up to twice as many are used."""
    rough_points: int = 16_384
    """Points that measure a level under way, for a checkpoint."""
    watched_points: int = 1024
    """Held-out points of the mean |f| in progress reports: less than 1 % of the training's work."""
    timing_points: int = 4096
    """Points of an evaluation that is timed."""
    timings: int = 4
    """Times that it is timed."""
    field_points: int = 20_000
    """Points of the ball, and of the band, at which the field is compared with the distance."""
    tracing: TracingConfig = TracingConfig()
    comparing: ComparingConfig = ComparingConfig()
