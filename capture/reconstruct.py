"""From photographs to a model (Appendix F): what the verb `photos` does, without its text."""

import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import torch

from ..model.errors import UserError
from ..model.model import Model, Network
from ..trainer.machine import device, prepare
from ..trainer.networks.fit import Budget, TrainingProgress
from ..trainer.networks.snapshot import Snapshot
from ..trainer.part import Part
from .bundle import rays_of
from .finish import distilled, finished_model, surface_of, unfinished_model
from .learner import Learner
from .options import BACKGROUNDS
from .photo_settings import FIRST_BAND, NARROWER, PhotoSettings
from .pictured import mean_psnr
from .posed import Photographs, split
from .scene import MultiscaleScene, Sizes

REPORTS = 10
"""How often the PSNR of a held-out view is said."""
ADVANCE_EVERY = 10
"""Steps between two reports to the progress."""
SMOOTHING = 0.02
"""Weight of a new loss in the mean that is shown."""
NO_MATTER = {"seconds", "device", "credit"}
"""Settings that may be others where a reconstruction is gone on with."""


class Reconstruction:
    """One reconstruction from photographs."""

    interrupted = False
    """Whether Ctrl-C ended it; known after `run`."""

    def __init__(
        self,
        photographs: Photographs,
        settings: PhotoSettings,
        progress: TrainingProgress,
        part: Part | None = None,
        began: float | None = None,
    ) -> None:
        """part: where it is kept every 30 s. began: the value of time.perf_counter() from which on seconds count."""
        self._photographs, self._settings, self._progress, self._part = photographs, settings, progress, part
        self._began = time.perf_counter() if began is None else began
        self._device = device(settings.device)
        prepare(self._device)
        self._learnt, self._held = split(photographs, settings.held_out)
        rays, _ = rays_of(self._learnt, self._device)
        if not len(rays):
            raise UserError("no photograph shows the ball that the object is in; are the cameras right?")
        sizes = Sizes(settings.levels, settings.omegas, settings.deltas, settings.radiance)
        self.scene = MultiscaleScene(sizes, self._device, settings.seed)
        self._background = BACKGROUNDS[settings.background]
        self._learner = Learner(self.scene, rays, settings.rays, self._background, settings.seed)
        self._steps, self._share, self._spent, self._loss = 0, 0.0, 0.0, 0.0
        self._psnr: float | None = None

    def run(self, earlier: tuple[Model, Snapshot] | None = None) -> Model:
        """Learn everything, and return the model. earlier: what a `Part` holds, to go on from.

        Raises UserError where that is of other settings, or where no surface was found, and KeyboardInterrupt where
        Ctrl-C came before the first step.
        """
        if earlier is None:
            self.scene.become_sphere(self._settings.seed)
        else:
            self._take_up(*earlier)
        self._progress.begin("photographs")
        try:
            self._learn()
        except KeyboardInterrupt:
            if not self._steps:
                raise
            self.interrupted = True
            if self._part is not None:
                self._part.write(self._model_so_far(), self._snapshot())
        self._progress.end()
        self._learner.check()
        return self._model()

    def _learn(self) -> None:
        settings = self._settings
        deadline = self._began + (settings.seconds or 0.0) - self._spent
        clock = Budget(settings.steps, deadline, 0.0 if settings.seconds is None else self._share).clock()
        said = int(self._share * REPORTS)
        while (share := clock(self._steps)) < 1:
            loss = self._learner.step(share)
            self._loss += max(SMOOTHING, 1 / (self._steps + 1)) * (loss - self._loss)
            self._steps, self._share = self._steps + 1, share
            if self._steps % ADVANCE_EVERY == 0:
                self._learner.check()
                self._progress.advance(share, self._loss)
            if int(share * REPORTS) > said:
                said = int(share * REPORTS)
                self._say()
            if self._part is not None and self._part.due():
                self._part.write(self._model_so_far(), self._snapshot())
        self._share = 1.0

    def _say(self) -> None:
        """Say how good the first held-out view is by now."""
        if self._held:
            view = self._held[0]
            self._progress.say(f"step {self._steps}: {view.name}, held out: {self._measured(1):.2f} dB")

    def _measured(self, count: int | None = None) -> float | None:
        return mean_psnr(self.scene, self._held[:count], self._learner.effort, self._background, self._device)

    def _take_up(self, model: Model, snapshot: Snapshot) -> None:
        if _that_matter(model.provenance.get("settings")) != _that_matter(self._written()):
            raise UserError("--resume: it was begun with other options; give the same, or leave out --resume")
        self._learner.restore(snapshot)
        self._steps, self._share = snapshot.whole("steps"), snapshot.real("share")
        self._spent, self._loss = snapshot.real("seconds"), snapshot.real("loss")
        seconds = self._settings.seconds
        if seconds is not None and seconds < self._spent + 1:
            raise UserError(f"--seconds {seconds:g}: {self._spent:.0f} s went before it was cut short; give more")

    def _snapshot(self) -> Snapshot:
        numbers = {"steps": self._steps, "share": self._share, "seconds": self._seconds(), "loss": self._loss}
        return self._learner.snapshot() | Snapshot(numbers)

    def _seconds(self) -> float:
        return self._spent + time.perf_counter() - self._began

    def _written(self) -> dict[str, Any]:
        """Return the settings as JSON has them."""
        written: dict[str, Any] = json.loads(json.dumps(asdict(self._settings)))
        return written

    def _provenance(self) -> dict[str, Any]:
        width, height = self._photographs.views[0].size
        views = {"folder": self._photographs.name, "views": len(self._photographs.views), "size": [width, height]}
        return {
            "source": views | {"held_out": [view.name for view in self._held], "masks": self._photographs.masked},
            "settings": self._written(),
            "seconds": round(self._seconds(), 3),
            "steps": self._steps,
            "interrupted": self.interrupted,
            "psnr": self._psnr,
            "sharpness": float(self.scene.sharpness().detach()),
            "versions": {"torch": torch.__version__, "numpy": np.__version__},
        }

    def _model_so_far(self) -> Model:
        provenance = self._provenance() | {"interrupted": True}
        return unfinished_model(self._photographs, self.scene.weights(), self._settings.deltas, provenance)

    def _model(self) -> Model:
        """Measure everything and put the model together."""
        self._psnr = self._measured()
        levels = [[w.cpu() for w in weights] for weights in self.scene.weights()]
        deltas = self._settings.deltas
        surface = surface_of(levels, deltas)
        bands = [*deltas[: len(levels) - 1], FIRST_BAND * NARROWER ** (len(levels) - 1)]
        colour = self._texture(levels, bands[-1], surface)
        return finished_model(self._photographs, levels, bands, colour, surface, self._provenance())

    def _texture(self, levels: Sequence[Any], width: float, surface: torch.Tensor) -> Network:
        features = self.scene.field.features(surface.to(self._device)).cpu()
        radiance, seed = self.scene.radiance.cpu(), self._settings.seed
        return distilled(levels, width, surface, features, radiance, self._learnt, self._progress, seed)


def _that_matter(settings: object) -> object:
    if not isinstance(settings, dict):
        return None
    timed = settings.get("seconds") is not None
    return {key: value for key, value in settings.items() if key not in NO_MATTER} | {"timed": timed}
