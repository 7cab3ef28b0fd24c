"""A ball to train on in a second, and a progress that keeps what is said."""

from pathlib import Path

import trimesh
from mplicits.model.model import Model
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training

SMALL = Settings(networks=((16, 1), (16, 1)), omegas=(8.0, 16.0), steps=(250, 250, 100))


class Log:
    """Progress that keeps what is said, and can press Ctrl-C."""

    def __init__(self, stop_in: str = "", at: float = 2.0) -> None:
        self.lines: list[str] = []
        self.stages: list[str] = []
        self._stop_in, self._at = stop_in, at

    def begin(self, stage: str) -> None:
        self.stages.append(stage)

    def advance(self, fraction: float, loss: float) -> None:
        assert 0 <= fraction <= 1
        if fraction >= self._at and self.stages[-1].startswith(self._stop_in):
            raise KeyboardInterrupt

    def end(self) -> None:
        pass

    def say(self, line: str) -> None:
        self.lines.append(line)


def load_ball(folder: Path) -> Shape:
    """A ball of radius 3, through a file in `folder`."""
    trimesh.creation.icosphere(subdivisions=4, radius=3.0).export(folder / "ball.ply")
    return load_shape(str(folder / "ball.ply"))[0]


def train(shape: Shape, settings: Settings = SMALL, log: Log | None = None, resume: Model | None = None) -> Model:
    return Training(shape, settings, log or Log()).run(resume)
