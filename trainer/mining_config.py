"""Hyperparameters of hard-example mining; config.py has the others, and their units."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ThinConfig:
    """Search for thin features of a mesh: slits, walls and sharp edges."""

    candidates: int = 400_000
    """Most surface points that are searched."""
    shortest_step: float = 0.0005
    """Least distance along the normal, to either side, at which the field is tested."""
    longest_step: float = 0.005
    suspects: int = 100_000
    """Most tested points whose distance to the surface is computed."""
    nearer: float = 0.8
    """A feature is thin where another part of the surface is nearer than this share of the step."""
    facing: float = 0.2
    """Largest cosine between the normals of both parts: sides of a slit face apart, sides of a crease do not."""
    gradient_step: float = 1e-4
    """Step of the central differences that give the normal of the other part."""
    least_distance: float = 0.0003
    """Least distance of a tested point from the surface."""
    margin: float = 0.0025
    """Least |f| that is taught there: a smaller value could keep the wrong sign."""
    satisfied: float = 0.7
    """Share of `margin` that f needs to have for the feature to be learnt."""
    spread: float = 0.004
    """Standard deviation along each axis of the points around a thin feature."""
    around: float = 1.5
    """Points around thin features, for each of their own points."""
    around_least_distance: float = 0.0008
    """Least distance of a point around a thin feature from the surface."""
    ratio: int = 5
    """Largest ratio of thin-feature samples to other hard samples."""
    copies: int = 64
    """Most copies of a thin-feature sample."""


@dataclass(frozen=True)
class MiningConfig:
    """Hard-example mining: the search for points off the surface where a level is badly wrong."""

    schedule: tuple[float, ...] = (0.3, 0.5, 0.7, 0.85, 0.93)
    """Shares of a level's schedule at which hard examples are mined, and loss weights adapted."""
    longest: float = 1 / 3
    """Skip the mining if it would take more than this share of the remaining time."""
    share: float = 0.1
    """Hard samples of a step, as a share of its samples off the surface, for a residual."""
    exact_share: float = 1 / 6
    """The same for a mesh that stands still, whose distances are exact; thin-feature samples come on top."""
    first_share: float = 0.3
    """The same for level 1."""
    candidates: int = 200_000
    """Points of the band, and of the domain, among which a residual's hard examples are searched."""
    first_candidates: int = 50_000
    """Points near the surface among which level 1's hard examples are searched."""
    first_reach: float = 0.6
    """Largest distance of these along an axis, in units of `SamplingConfig.first_band`."""
    suspects: int = 100_000
    """Most candidates whose distance to the surface is computed."""
    near: float = 0.2
    """A candidate is suspect where |f| is below this share of delta."""
    excess: float = 1.1
    """A point is hard where |f| exceeds the distance by this factor."""
    least_distance: float = 0.12
    """Least distance of a hard point at which f is too small, in half-widths delta."""
    wrong_sign: float = 0.001
    """Least distance of a hard point at which f has the wrong sign, where distances are exact."""
    spread: float = 0.15
    """Standard deviation of candidates around earlier hard points, in half-widths delta."""
    fewest: int = 16
    """Fewer hard points than this are ignored."""
    components: tuple[float, ...] = (0.85, 0.93)
    """Shares of the last level's schedule at which loose components of its surface are mined, too."""
    components_steps: int = 800
    """Fewest steps before that: after fewer, the surface is too rough."""
    component_cost: float = 6.0
    """Time of a search for loose components, as a multiple of the time of measuring a level."""
    component_ratio: float = 0.6
    """Ratio of samples around loose components to other hard samples."""
    component_spread: float = 0.004
    """Standard deviation along each axis of samples around loose components; a cell of the 512^3 grid that finds them
    is as wide."""
    thin: ThinConfig = ThinConfig()
