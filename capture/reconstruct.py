"""From photographs to a model (Appendix F)."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from ..model.errors import UserError
from ..model.interrupts import SecondInterrupt, between_steps
from ..model.model import Model, Network
from ..trainer.checkpoint import CheckpointFile
from ..trainer.field_levels import measured_levels
from ..trainer.machine import device, prepare
from ..trainer.networks.callback import TrainingProgress
from ..trainer.networks.fit import Budget
from ..trainer.networks.network import to_model
from ..trainer.networks.snapshot import Snapshot
from .distill import distilled, model_of, surface_of, unfinished_levels
from .evaluation import mean_psnr
from .learner import Learner
from .options import BACKGROUNDS, PhotoOptions
from .photographs import Photographs, split
from .rays import rays_of
from .scene import MultiscaleScene

REPORTS = 10  # number of reports of a held-out view's PSNR
ADVANCE_EVERY = 10  # steps between two reports of progress
SMOOTHING = 0.02  # weight of a new loss in the reported mean
RESUMABLE = {"seconds", "device", "credit"}
"""Settings that `--resume` may change."""


class Reconstruction:
    """One reconstruction from photographs."""

    interrupted = False
    """Whether Ctrl-C ended `run`."""

    def __init__(
        self,
        photographs: Photographs,
        options: PhotoOptions,
        progress: TrainingProgress,
        part: CheckpointFile | None = None,
        began: float | None = None,
    ) -> None:
        """part: receives the state every 30 s. began: time.perf_counter() at the start of the user's seconds."""
        self._photographs, self._options, self._progress, self._part = photographs, options, progress, part
        self._began = time.perf_counter() if began is None else began
        self._device = device(options.device)
        prepare(self._device)
        self._views, self._held_out = split(photographs, options.held_out)
        rays, _ = rays_of(self._views, self._device)
        if not len(rays):
            raise UserError("no photograph shows the ball around the object; check the cameras")
        if rays.inside is not None and not rays.inside.any():
            raise UserError("no mask shows a part of the ball around the object; check masks and cameras")
        sizes = options.sizes, options.omegas, options.deltas[:-1], options.radiance
        self.scene = MultiscaleScene(*sizes, self._device, options.seed)
        self._background = BACKGROUNDS[options.background]
        self._learner = Learner(self.scene, rays, options.rays, self._background, options.seed)
        self._steps, self._share, self._spent, self._loss = 0, 0.0, 0.0, 0.0
        self._psnr: float | None = None

    def run(self, earlier: tuple[Model, Snapshot] | None = None) -> Model:
        """Train, and return the model. earlier: content of a `CheckpointFile`, to continue from.

        Raises UserError if `earlier` has other settings, or if there is no surface, and KeyboardInterrupt for Ctrl-C
        before the first step.
        """
        if earlier is None:
            self.scene.become_sphere(self._options.seed)
        else:
            self._resume(*earlier)
        self._progress.begin("photographs")
        with between_steps() as take_signals:
            try:
                self._train(take_signals)
            except SecondInterrupt:
                raise
            except KeyboardInterrupt:
                if not self._steps:
                    raise
                self.interrupted = True
                self._save()
        self._progress.end()
        self._learner.check()
        return self._model()

    def _train(self, take_signals: Callable[[], None]) -> None:
        seconds = self._options.seconds
        budget = Budget(steps=self._options.steps)
        if seconds is not None:
            budget = Budget(deadline=self._began + seconds - self._spent, done=self._share)
        clock = budget.clock()
        reports = int(self._share * REPORTS)
        while (share := clock(self._steps)) < 1:
            take_signals()
            loss = self._learner.step(share)
            self._loss += max(SMOOTHING, 1 / (self._steps + 1)) * (loss - self._loss)
            self._steps, self._share = self._steps + 1, share
            if self._steps % ADVANCE_EVERY == 0:
                self._learner.check()
                self._progress.advance(share, self._loss)
            if int(share * REPORTS) > reports:
                reports = int(share * REPORTS)
                self._report()
            if self._part is not None and self._part.due():
                self._save()
        self._share = 1.0

    def _report(self) -> None:
        """Log the PSNR of the first held-out view."""
        decibels = self._mean_psnr(1)
        if decibels is not None:
            self._progress.say(f"step {self._steps}: {self._held_out[0].name}, held out: {decibels:.2f} dB")

    def _mean_psnr(self, count: int | None = None) -> float | None:
        return mean_psnr(self.scene, self._held_out[:count], self._learner.effort, self._background, self._device)

    def _resume(self, model: Model, snapshot: Snapshot) -> None:
        if _fixed(model.provenance.get("settings")) != _fixed(self._options.record()):
            raise UserError("--resume: the interrupted run had other options; repeat them, or drop --resume")
        self._learner.restore(snapshot)
        self._steps, self._share = snapshot.whole("steps"), snapshot.real("share")
        self._spent, self._loss = snapshot.real("seconds"), snapshot.real("loss")
        seconds = self._options.seconds
        if seconds is not None and seconds < self._spent + 1:
            raise UserError(f"--seconds {seconds:g}: {self._spent:.0f} s were spent before the interruption; set more")

    def _save(self) -> None:
        """Write the state and an unfinished model."""
        if self._part is not None:
            numbers = {"steps": self._steps, "share": self._share, "seconds": self._seconds(), "loss": self._loss}
            levels = unfinished_levels(self.scene.weights(), self._options.deltas)
            model = model_of(self._photographs, levels, None, self._provenance() | {"interrupted": True})
            self._part.write(model, self._learner.snapshot() | Snapshot(numbers))

    def _seconds(self) -> float:
        return self._spent + time.perf_counter() - self._began

    def _provenance(self) -> dict[str, Any]:
        width, height = self._photographs.views[0].size
        views = {"folder": self._photographs.name, "views": len(self._photographs.views), "size": [width, height]}
        return {
            "source": views | {"held_out": [view.name for view in self._held_out], "masks": self._photographs.masked},
            "settings": self._options.record(),
            "seconds": round(self._seconds(), 3),
            "steps": self._steps,
            "interrupted": self.interrupted,
            "psnr": self._psnr,
            "sharpness": float(self.scene.sharpness().detach()),
            "versions": {"torch": torch.__version__, "numpy": np.__version__},
        }

    def _model(self) -> Model:
        """Measure the levels, distill the colors, and assemble the model."""
        self._psnr = self._mean_psnr()
        levels = [[w.cpu() for w in weights] for weights in self.scene.weights()]
        deltas = self._options.deltas[: len(levels)]
        surface = surface_of(levels, deltas)
        color: Network = distilled(
            levels,
            deltas[-1],
            surface,
            self.scene.field.features(surface.to(self._device)).cpu(),
            self.scene.radiance.cpu(),
            self._views,
            self._progress,
            self._options.seed,
        )
        measured = measured_levels([to_model(weights) for weights in levels], surface, surface, deltas)
        return model_of(self._photographs, measured, color, self._provenance())


def _fixed(settings: object) -> object:
    """Select the settings that `--resume` must not change."""
    if not isinstance(settings, dict):
        return None
    timed = settings.get("seconds") is not None
    return {key: value for key, value in settings.items() if key not in RESUMABLE} | {"timed": timed}
