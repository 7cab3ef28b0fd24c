"""A shape -> a model: level after level, each frozen before the next begins; then the texture."""

import json
import time
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import torch

from ..model.errors import UserError
from ..model.model import DEFAULT_ITERATIONS, Level, Model, shape_of
from . import level, quality, texture
from .networks.fit import Budget, Outcome, Progress, Step, Task, fit
from .networks.network import Weights, clone, from_model, to_model
from .networks.rounding import rounded, rounding
from .pools import Sampler
from .settings import Settings
from .shapes.shape import Shape

POOL = 200_000
"""Most samples of a pool."""
POOL_PER_STEP, POOL_PER_SECOND, POOL_LEAST = 100, 6000, 8192
COLOURS = 5
"""Samples of colour for each of a pool: images have more detail than shapes, and few samples are learnt by heart."""
WRITING = 0.1
"""Seconds kept for writing the file."""
TEXTURE_COST = 0.5
"""Share of the time of a texture network of the cost of a level."""


@dataclass
class _Trained:
    weights: Weights
    delta: float
    lipschitz: float
    record: dict[str, Any]


class Training:
    """One training. `run` returns the model; `interrupted` then says whether Ctrl-C ended it.

    began: time.perf_counter() at which the user's seconds start to count.
    """

    def __init__(self, shape: Shape, settings: Settings, progress: Progress, began: float | None = None) -> None:
        self.interrupted = False
        self._shape, self._settings, self._progress = shape, settings, progress
        self._began = time.perf_counter() if began is None else began
        self._device = device(settings.device)
        self._probe = quality.Probe(shape, self._device)
        self._levels: list[_Trained] = []
        self._texture: Weights | None = None
        self._texture_record: dict[str, Any] | None = None
        self._spent = 0.0

    def run(self, resume: Model | None = None) -> Model:
        """Trains what `resume` lacks.

        Raises UserError where `resume` does not fit the settings, KeyboardInterrupt where Ctrl-C came before there was
        anything to save.
        """
        begun = self._take_over(resume) if resume else None
        fresh = len(self._levels)
        plan = self._plan()
        try:
            for index in range(len(self._levels), len(self._settings.networks)):
                self._train_level(index, plan[index], begun)
                begun = None
                if self.interrupted:
                    break
            if self._shape.coloured and self._settings.texture and not self.interrupted and self._texture is None:
                self._train_texture(plan[-1])
        except KeyboardInterrupt:
            if len(self._levels) == fresh:
                raise
            self.interrupted = True
        return self._model()

    def _plan(self) -> list[Budget]:
        """A budget for every level and the texture. Seconds are shared out by the square root of a step's cost.

        Level 1 gets its share by the largest network's: what it gets wrong, far from the surface, costs every residual.
        """
        settings, seconds = self._settings, self._settings.seconds
        if seconds is None:
            return [Budget(steps=n) for n in settings.steps]
        roots = [_cost(network) ** 0.5 for network in settings.networks]
        costs = [0.0 if i < len(self._levels) else 3 * root if i else max(roots) for i, root in enumerate(roots)]
        wanted = self._shape.coloured and settings.texture and self._texture is None
        costs.append(TEXTURE_COST * max(costs) if wanted else 0.0)
        ends = np.cumsum(costs) / max(sum(costs), 1e-9)
        now = time.perf_counter()
        left = self._began + seconds - WRITING - now
        return [Budget(deadline=now + left * float(end)) for end in ends]

    def _train_level(self, index: int, budget: Budget, begun: tuple[Weights, float] | None) -> None:
        settings, (width, depth) = self._settings, self._settings.networks[index]
        began, seed = time.perf_counter(), settings.seed * 1000 + index
        self._progress.begin(f"level {index + 1} ({width}x{depth})")
        frozen = [trained.weights for trained in self._levels]
        band = self._levels[-1].delta if frozen else None
        deltas = [trained.delta for trained in self._levels]
        sampler = Sampler(self._shape, frozen, deltas, self._device, np.random.default_rng(seed))
        count = self._pool_size(budget)
        surface, volume = sampler.surface(count), sampler.volume(count)
        start = level.start((width, depth), settings.omegas[index], first=index == 0, seed=seed, device=self._device)
        if begun:
            weights, done = begun
            budget = replace(budget, done=done)
            start = partial(clone, weights)
        if budget.steps is None:
            last = self._probe.seconds([*frozen, start()])
            budget = replace(budget, deadline=budget.deadline - last)
        weight = settings.loss_weights(first=index == 0)
        task = Task(
            start,
            self._step(level.step(surface, volume, weight, torch.Generator().manual_seed(seed))),
            level.idle_loss(surface, volume, weight),
            *level.rates(width, band),
        )
        outcome = fit(task, budget, self._progress)
        self._progress.end()
        if outcome.failed and not frozen:
            raise UserError(f"level 1 ({width}x{depth}) learnt nothing of the shape; try another --omega or --weights")
        if not (frozen or outcome.steps or outcome.interrupted):
            raise UserError(f"--seconds {settings.seconds:g}: no time was left for a step of level 1; give more")
        self.interrupted = outcome.interrupted
        weights = self._final(outcome.weights)
        levels = [*frozen, weights]
        record = {"network": f"{width}x{depth}", "omega": settings.omegas[index]} | _record(outcome, began)
        self._levels.append(
            _Trained(
                weights,
                self._probe.delta(levels),
                quality.lipschitz(levels, torch.cat((surface.points, volume.points))),
                record,
            )
        )

    def _train_texture(self, budget: Budget) -> None:
        began, settings = time.perf_counter(), self._settings
        seed = settings.seed * 1000 + 999
        network, omega = settings.texture_size(), settings.texture_omega()
        self._progress.begin(f"texture ({network[0]}x{network[1]})")
        sampler = Sampler(
            self._shape,
            [trained.weights for trained in self._levels],
            [trained.delta for trained in self._levels],
            self._device,
            np.random.default_rng(seed),
        )
        count = self._pool_size(budget)
        surface, around = sampler.coloured(COLOURS * count), sampler.band(count)
        task = Task(
            texture.start(network, omega, seed, self._device),
            self._step(texture.step(surface, around, torch.Generator().manual_seed(seed))),
            texture.idle_loss(surface),
            texture.RATE,
            texture.LAST,
        )
        outcome = fit(task, budget, self._progress)
        self._progress.end()
        self.interrupted = outcome.interrupted
        self._texture = self._final(outcome.weights)
        record = {"network": f"{network[0]}x{network[1]}", "omega": omega}
        self._texture_record = record | _record(outcome, began)

    def _step(self, step: Step) -> Step:
        return rounding(step) if self._settings.packed else step

    def _final(self, weights: Weights) -> Weights:
        return rounded(weights) if self._settings.packed else weights

    def _pool_size(self, budget: Budget) -> int:
        if budget.steps is not None:
            wanted = budget.steps * POOL_PER_STEP
        else:
            wanted = int((budget.deadline - time.perf_counter()) * POOL_PER_SECOND)
        return min(max(wanted, POOL_LEAST), POOL)

    def _take_over(self, resume: Model) -> tuple[Weights, float] | None:
        """Takes the finished levels of `resume`; returns the weights of an unfinished last one and its share done."""
        records = resume.provenance.get("levels")
        if (
            not isinstance(records, list)
            or len(records) != len(resume.levels)
            or any(_share(record) is None for record in records)
        ):
            raise UserError("--resume: this model does not say how it was trained; train a new one")
        if resume.provenance.get("source") != self._shape.source:
            raise UserError("--resume: this model was trained on another shape; name another output with -o")
        networks = [shape_of(old.network) for old in resume.levels]
        wanted = [f"{width}x{depth}" for width, depth in self._settings.networks]
        if networks != wanted[: len(networks)]:
            raise UserError(f"--resume: the model has levels {','.join(networks)}, --levels says {','.join(wanted)}")
        self._spent = float(resume.provenance.get("seconds", 0.0))
        begun = None
        for old, record in zip(resume.levels, records, strict=True):
            weights = [w.to(self._device) for w in from_model(old.network)]
            if (share := _share(record)) is not None and share < 1:
                begun = weights, share
                break
            self._levels.append(_Trained(weights, old.delta, old.lipschitz, record))
        record = resume.provenance.get("texture")
        if resume.texture is not None and record and len(self._levels) == len(wanted) and _share(record) == 1:
            self._texture = [w.to(self._device) for w in from_model(resume.texture)]
            self._texture_record = record
        return begun

    def _model(self) -> Model:
        shape, settings, levels = self._shape, self._settings, self._levels
        found = self._probe.measure([trained.weights for trained in levels])
        first, finer = DEFAULT_ITERATIONS
        return Model(
            name=shape.name,
            levels=tuple(
                Level(to_model(trained.weights), trained.delta, finer if i else first, trained.lipschitz)
                for i, trained in enumerate(levels)
            ),
            texture=None if self._texture is None else to_model(self._texture),
            centre=shape.centre,
            scale=shape.scale,
            provenance={
                "source": shape.source,
                "seed": settings.seed,
                "settings": json.loads(json.dumps(asdict(settings))),
                "seconds": round(self._spent + time.perf_counter() - self._began, 3),
                "interrupted": self.interrupted,
                "levels": [trained.record | asdict(figures) for trained, figures in zip(levels, found, strict=True)],
                "texture": self._texture_record,
                "versions": {"torch": torch.__version__, "numpy": np.__version__},
            },
        )


def device(name: str) -> torch.device:
    """The device by the name auto, cpu or cuda. Raises UserError where there is no CUDA device."""
    if name == "cuda" and not torch.cuda.is_available():
        raise UserError("--device cuda: this PyTorch finds no CUDA device; use --device cpu")
    return torch.device("cuda" if name == "cuda" or (name == "auto" and torch.cuda.is_available()) else "cpu")


def _share(record: object) -> float | None:
    """Share of its schedule that a network has behind it, by its record; None where it does not say."""
    share = record.get("fraction") if isinstance(record, dict) else None
    return float(share) if isinstance(share, int | float) else None


def _cost(network: tuple[int, int]) -> float:
    width, depth = network
    return width * 4 + width * width * depth


def _record(outcome: Outcome, began: float) -> dict[str, Any]:
    return {
        "steps": outcome.steps,
        "fraction": outcome.fraction,
        "restarts": outcome.restarts,
        "rate": outcome.rate,
        "loss": outcome.loss,
        "seconds": round(time.perf_counter() - began, 3),
    }
