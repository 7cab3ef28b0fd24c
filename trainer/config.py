"""Hyperparameters of training; the user's options are in options.py and settings.py.

Lengths are in model units (the shape fits the unit sphere). Values without another source were tuned on Stanford and
Thingi meshes (docs/lessons.md). Nothing here needs torch.
"""

from dataclasses import dataclass, replace

from .measuring_config import MeasuringConfig
from .mining_config import MiningConfig


@dataclass(frozen=True)
class LossWeights:
    """Factors of the terms of a level's loss (Eq. 4)."""

    value: float
    """Factor of (f - distance)^2 on the surface."""
    normal: float
    """Factor of the normal term."""
    eikonal: float
    """Factor of the Eikonal term."""
    distance: float
    """Factor of (f - distance)^2 off the surface."""
    excess: float = 1.0
    """Further factor of the distance term where |f| exceeds the distance."""
    lacking: float = 1.0
    """Further factor of the distance term where f has the wrong sign, or less than losses.LACK of the distance."""
    length: float = 1.0
    """Further factor of the Eikonal term on the surface; for a cloud it changes during training (SurfaceEikonal)."""
    near: float = 0.008
    """Distance from the surface below which `excess` does not apply."""


@dataclass(frozen=True)
class LossConfig:
    """Weights of the loss, and how they depend on the shape and on the schedule."""

    first_level: LossWeights = LossWeights(value=1e4, normal=30.0, eikonal=1.0, distance=3000.0, excess=20.0)
    """Level 1 has to be a distance in the whole domain."""
    residual: LossWeights = LossWeights(3e5, 100.0, 3.0, distance=3000.0, excess=40.0, lacking=20.0, near=0.003)
    """A residual spends its capacity on the surface."""
    late: float = 0.85
    """Share of the schedule after which `value` grows; from the start, the larger weight would flatten the field."""
    late_value: float = 10.0
    """Factor on `value` after that, for residuals of meshes that stand still."""
    noisy_first_value: float = 0.3
    """Largest `value` of level 1 of a noisy cloud, times the variance of the noise; more would flatten the field."""
    noisy_value: float = 3.0
    """Largest `value` of a residual of a noisy cloud, times the variance of the noise."""
    noisy_eikonal: float = 20.0
    """`eikonal` of a residual of a noisy cloud."""
    cloud_length: float = 15.0
    """Least `length` of a residual of a cloud."""
    moving_eikonal: float = 45.0
    """`eikonal` of a shape that moves: merging fronts and vanishing limbs would leave flat regions."""

    def of_level(self, *, first: bool, noise: float, cloud: bool, moving: bool) -> LossWeights:
        """Return the default loss weights of level 1 or of a residual.

        noise: standard deviation of the noise that was removed from a cloud's points, model units.
        """
        weights = self.first_level if first else self.residual
        if noise:
            most = (self.noisy_first_value if first else self.noisy_value) / noise**2
            eikonal = weights.eikonal if first else self.noisy_eikonal
            near = self.first_level.near
            weights = replace(weights, value=min(weights.value, most), eikonal=eikonal, near=near)
        elif cloud and not first:
            weights = replace(weights, length=self.cloud_length)
        return replace(weights, eikonal=self.moving_eikonal) if moving else weights


@dataclass(frozen=True)
class SurfaceEikonalConfig:
    """How `LossWeights.length` follows the gradient on a cloud's surface during training."""

    shortest: float = 0.8
    """Least |grad f| that counts as a distance's."""
    longest: float = 1.2
    """Largest |grad f| that counts as a distance's."""
    goal: float = 0.92
    """Share of the surface points whose |grad f| is to be in that range."""
    goal_per_noise: float = 3.5
    """Increase of the goal per unit of noise: noisy points are off the surface, where |grad f| is nearer to 1."""
    largest_goal: float = 0.985
    least_learnt: float = 0.6
    """Share below which the surface is not learnt yet, and the weight stays."""
    points: int = 20_000
    """Surface points at which the share is measured."""
    least_factor: float = 0.5
    """Least factor on the weight at one time."""
    largest_factor: float = 3.0
    """Largest factor on the weight at one time."""
    largest: float = 200.0
    """Largest weight."""


@dataclass(frozen=True)
class StepConfig:
    """Optimizer steps of a level."""

    batch: int = 4096
    """Samples of a step, half of them on the surface."""
    rate: float = 20e-3
    """Peak learning rate of hidden layers up to `rate_width`; that of wider layers falls in proportion to the width."""
    rate_width: int = 64
    output_factor: float = 0.1
    """Factor on the rate of the output layer, whose weights are smaller by omega_0."""
    output_factor_per_delta: float = 5.0
    """Largest such factor of a residual per half-width delta of its band: it adds little in a narrow band."""
    residual_output: float = 0.01
    """Factor on the initial output layer of a residual, which starts near zero."""


@dataclass(frozen=True)
class SamplingConfig:
    """Training samples of a level, drawn once as a pool."""

    largest_pool: int = 200_000
    smallest_pool: int = 8192
    pool_per_step: int = 100
    """Samples per optimizer step, within these limits."""
    pool_per_second: int = 6000
    """Samples per second of training, where the user gives seconds."""
    first_band: float = 0.1
    """Half-width of the shell around the surface in which level 1 has more samples."""
    first_band_share: float = 0.3
    """Share of level 1's volume samples in that shell."""
    ball_radius: float = 1.03
    """Radius of the ball of most volume samples of level 1; rays and distances need radius 1."""
    corner_share: float = 0.06
    """Share of level 1's volume samples outside the ball, in the corners of the domain."""
    largest_distance: float = 4.0
    """Largest distance that a residual learns, in half-widths delta; dithering (Fig. 3a) reaches 3.5."""
    stray_candidates: int = 400_000
    """Points of the domain among which strays are searched: points of the band where the levels before are wrong."""
    stray_suspects: int = 50_000
    """Most candidates whose distance to the surface is computed."""
    strays: int = 4096
    """Most strays."""
    stray_error: float = 0.5
    """Least error of a stray, in half-widths delta."""
    stray_share: float = 0.15
    """Strays, as a share of the surface points around which a residual's volume samples are drawn."""


@dataclass(frozen=True)
class TextureConfig:
    """The texture network (Section 3.2)."""

    batch: int = 4096
    """Samples of a step, half of them on the surface."""
    colors_per_sample: int = 5
    """Color samples for each sample of a pool: images have more detail than shapes."""
    rate: float = 3e-2
    """Peak learning rate of the hidden layers."""
    output_factor: float = 0.1
    """Factor on the rate of the output layer."""
    smoothness: float = 2e-4
    """Weight of <grad g, grad f>^2: derivatives of color are larger than colors by about omega_0."""


@dataclass(frozen=True)
class BudgetConfig:
    """How a user's seconds are shared out."""

    writing: float = 0.1
    """Seconds kept for writing the file."""
    residual: float = 3.0
    """Seconds of a residual, relative to level 1 with steps of the same cost."""
    texture: float = 0.5
    """Seconds of the texture, relative to the costliest level."""
    least: float = 0.5
    """Least share of a stage's seconds for its steps; a preparation that leaves less prolongs the training."""
    checkpoint_every: float = 30.0
    """Seconds between two writes of NAME.part.safetensors, whose loss a crash costs."""


@dataclass(frozen=True)
class DefaultLengths:
    """Networks and steps where the user gives none."""

    omegas: tuple[float, ...] = (40.0, 80.0, 120.0)
    """omega_0 of levels 1, 2, ... of at least `omega_width`; further levels take the last."""
    omega_width: int = 64
    """Width below which omega_0 falls with the root of the width: narrow networks cannot fill the spectrum."""
    steps: tuple[int, int] = (4000, 10_000)
    """Optimizer steps of level 1 and of each finer level."""
    texture_steps: int = 2000
    texture_omega: float = 50.0
    texture_network: tuple[int, int] = (64, 2)
    """Largest (width, depth) of the texture network, which otherwise has the size of the last level."""


@dataclass(frozen=True)
class BendConfig:
    """How the default omega_0 follows the bend of a shape (suited_omegas.py)."""

    points: int = 20_000
    """Surface points among which neighbors are compared."""
    nearest: float = 0.02
    """Least distance of neighbors."""
    farthest: float = 0.03
    """Largest distance of neighbors."""
    smooth: float = 4.0
    """Bend, degrees, up to which omega_0 is that of `omegas`."""
    rough: float = 6.0
    """Bend from which on omega_0 is that of `DefaultLengths`; it is linear between."""
    omegas: tuple[float, ...] = (15.0, 20.0, 30.0)
    """omega_0 of levels 1, 2, ... of smooth shapes at every width, where it is less than usual."""


@dataclass(frozen=True)
class TrainingConfig:
    """All hyperparameters of a training."""

    loss: LossConfig = LossConfig()
    surface_eikonal: SurfaceEikonalConfig = SurfaceEikonalConfig()
    step: StepConfig = StepConfig()
    sampling: SamplingConfig = SamplingConfig()
    mining: MiningConfig = MiningConfig()
    texture: TextureConfig = TextureConfig()
    measuring: MeasuringConfig = MeasuringConfig()
    budget: BudgetConfig = BudgetConfig()
    lengths: DefaultLengths = DefaultLengths()
    bend: BendConfig = BendConfig()


DEFAULT = TrainingConfig()


def default_config() -> TrainingConfig:
    """Return the hyperparameters of every training that gets no others."""
    return DEFAULT
