"""A ball that trains within a second, a quick configuration, and a progress that records its calls."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from mplicits.model.model import Model
from mplicits.trainer.config import DefaultLengths, SamplingConfig, StepConfig, TextureConfig, TrainingConfig
from mplicits.trainer.frozen_levels import FrozenLevels
from mplicits.trainer.measuring_config import ComparingConfig, MeasuringConfig, TracingConfig
from mplicits.trainer.mining_config import MiningConfig, ThinConfig
from mplicits.trainer.networks.network import Weights
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training

CPU = torch.device("cpu")
SMALL_SETTINGS = Settings(networks=((16, 1), (16, 1)), omegas=(8.0, 16.0), steps=(250, 250, 100))
QUICK = TrainingConfig(
    step=StepConfig(batch=2048),
    sampling=SamplingConfig(smallest_pool=2048, pool_per_step=10, stray_candidates=20_000),
    mining=MiningConfig(candidates=10_000, thin=ThinConfig(candidates=10_000)),
    texture=TextureConfig(batch=512),
    measuring=MeasuringConfig(
        points=4000,
        band_points=4000,
        lipschitz_points=4000,
        rough_points=2000,
        field_points=2000,
        tracing=TracingConfig(rays=128, rounds=1, worst=64, samples=100),
        comparing=ComparingConfig(lines=2048, points=2000, along=TracingConfig(samples=100)),
    ),
)
"""Draws and measures fewer points."""


def use_quick_config(patch: pytest.MonkeyPatch) -> None:
    """Let all trainings draw and measure fewer points, and survey the surface on a coarse grid."""
    patch.setattr("mplicits.trainer.config.DEFAULT", QUICK)
    for name in ("RESOLUTION", "MOVING_RESOLUTION", "MOMENT_RESOLUTION"):
        patch.setattr(f"mplicits.mesher.surface_line.{name}", 16)


def with_texture_steps(steps: int) -> TrainingConfig:
    """Return the default configuration with another number of texture steps."""
    return TrainingConfig(lengths=DefaultLengths(texture_steps=steps))


class Log:
    """A `TrainingProgress` that records stages and lines, and can press Ctrl-C."""

    def __init__(self, stop_in: str = "", at: float = 2.0) -> None:
        """Press Ctrl-C in the stage whose name begins with `stop_in`, once the share `at` of it is done."""
        self.lines: list[str] = []
        self.stages: list[str] = []
        self._stop_in, self._at = stop_in, at

    def begin(self, stage: str) -> None:
        self.stages.append(stage)

    def advance(self, fraction: float, loss: float) -> None:
        assert 0 <= fraction <= 1
        if fraction >= self._at and self.stages[-1].startswith(self._stop_in):
            raise KeyboardInterrupt

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        pass

    def end(self) -> None:
        pass

    def say(self, line: str) -> None:
        self.lines.append(line)


def load_ball(folder: Path) -> Shape:
    """Write a ball of radius 3 to a file in `folder`, and load it as a shape."""
    trimesh.creation.icosphere(subdivisions=4, radius=3.0).export(folder / "ball.ply")
    return load_shape(str(folder / "ball.ply"))[0]


def train(
    shape: Shape,
    settings: Settings = SMALL_SETTINGS,
    log: Log | None = None,
    resume: Model | None = None,
    config: TrainingConfig = QUICK,
) -> Model:
    """Train `shape`, or what the model `resume` lacks."""
    return Training(shape, settings, log or Log(), config=config).run(resume)


def constant(number: float) -> Weights:
    """Return a network whose value is `number` everywhere."""
    return [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.full((1,), number)]


def frozen_level(delta: float, f: float = 0.0) -> FrozenLevels:
    """Return a frozen level 1 whose value is `f` everywhere."""
    return FrozenLevels([constant(f)], [delta], CPU)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)
