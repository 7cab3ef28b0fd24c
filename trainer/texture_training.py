"""The training of the texture: its samples, and its optimizer step."""

import numpy as np
import torch

from . import texture
from .config import TextureConfig
from .frozen_levels import FrozenLevels
from .networks.fit import Step, Task
from .shapes.shape import Shape
from .stage import Stage
from .texture_detail import detail_line
from .training_samples import Sampler


class TextureTraining:
    """The training of the texture network g on the surface and in level 1's band."""

    def __init__(self, shape: Shape, config: TextureConfig, frozen: FrozenLevels, stage: Stage) -> None:
        """frozen: all levels."""
        self._config, self._frozen, self._stage, self._moving = config, frozen, stage, shape.moving
        sampler = Sampler(shape, frozen, np.random.default_rng(stage.seed))
        self._surface = sampler.colors(config.colors_per_sample * stage.samples)
        band = sampler.first_band(stage.samples)
        self.step = texture.TextureStep(self._surface, band, torch.Generator().manual_seed(stage.seed), config)

    def blurred(self) -> str:
        """Say that the colors have more detail than the network holds; "" if not, and where the shape moves."""
        surface = self._surface
        if self._moving or surface.colors is None:
            return ""
        points, colors = (part.cpu().numpy().astype(np.float64) for part in (surface.points, surface.colors))
        return detail_line(points, colors, self._stage.network)

    def task(self, step: Step) -> Task:
        """Return the task for `fit`. step: calls `self.step`."""
        stage, device, moving = self._stage, self._frozen.device, self._moving
        return Task(
            start=lambda: texture.initial_texture(stage.network, stage.omega, stage.seed, device, moving=moving),
            step=step,
            idle=texture.idle_loss(self._surface),
            rate=self._config.rate,
            output_factor=self._config.output_factor,
            rest=texture.mean_color(self._surface),
            draws=self.step,
        )
