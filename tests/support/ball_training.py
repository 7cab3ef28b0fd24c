"""A ball that trains within a second, and a progress that keeps what it is told."""

from collections.abc import Mapping
from pathlib import Path

import trimesh

from mplicits.mesher import survey
from mplicits.model.model import Model
from mplicits.trainer import hard, level, plan, pools, quality, texture, tracing
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training

SMALL_SETTINGS = Settings(networks=((16, 1), (16, 1)), omegas=(8.0, 16.0), steps=(250, 250, 100))
QUICK_NUMBERS = (
    (quality, "POINTS", 4000),
    (quality, "BAND_POINTS", 4000),
    (quality, "FIELD_POINTS", 2000),
    (quality, "LIPSCHITZ_POINTS", 4000),
    (quality, "ROUGH_POINTS", 2000),
    (tracing, "RAYS", 128),
    (level, "BATCH", 512),
    (texture, "BATCH", 512),
    (plan, "POOL_LEAST", 1024),
    (plan, "POOL_PER_STEP", 10),
    (survey, "RESOLUTION", 16),
    (pools, "STRAY_CANDIDATES", 20_000),
    (hard, "CANDIDATES", 10_000),
    (hard, "THIN_CANDIDATES", 10_000),
)
"""Modules, names and values: with them a training draws and measures less, with and without a break."""


class Log:
    """A `TrainingProgress` that keeps stages and lines, and can press Ctrl-C."""

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
    shape: Shape, settings: Settings = SMALL_SETTINGS, log: Log | None = None, resume: Model | None = None
) -> Model:
    """Train `shape`, or what the model `resume` lacks."""
    return Training(shape, settings, log or Log()).run(resume)
