"""What a training has finished: as the model that is saved, and read back from it to go on (`--resume`)."""

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import torch

from ..model.errors import UserError
from ..model.field_figures import FieldFigures
from ..model.model import DEFAULT_ITERATIONS, DEFAULT_STEP_BOUND, Level, Model, shape_of
from ..model.orientation import DEFAULT_UP
from .networks.fit import Outcome
from .networks.network import Weights, from_model, to_model
from .networks.snapshot import Snapshot
from .quality import Quality
from .settings import Settings
from .shapes.shape import Shape

NO_MATTER = {"wish", "up", "front", "credit", "device", "seconds"}
"""Settings that may be others where a training is gone on with; `up` is part of the shape, which must be the same."""


@dataclass
class TrainedLevel:
    """A level that is trained, and frozen from now on."""

    weights: Weights
    delta: float
    """Half width of its band, model units (Eq. 5)."""
    lipschitz: float
    """Largest |grad f_i| measured in its domain."""
    step_bound: float
    """Largest factor on its steps with which no ray passed through the shape, where it is the last level traced."""
    band_step_bound: float
    """The same where a finer level is traced; 1 while there is none."""
    record: dict[str, Any]
    """What the provenance tells of its training; see `training_record`."""

    def bounds(self) -> tuple[float, float, float]:
        """Return the bounds that a `Level` has, in its order."""
        return self.lipschitz, self.step_bound, self.band_step_bound


@dataclass
class TrainedTexture:
    """A texture network that is trained."""

    weights: Weights
    record: dict[str, Any]
    """What the provenance tells of its training; see `training_record`."""


@dataclass
class Unfinished:
    """The last level of an interrupted training."""

    weights: Weights
    fraction: float
    """Share of its schedule that is done."""


@dataclass
class Trained:
    """The networks that a training has finished so far."""

    levels: list[TrainedLevel] = field(default_factory=list)
    texture: TrainedTexture | None = None
    unfinished: Unfinished | None = None
    """The level after `levels`, where an interrupted training left it half done."""
    seconds: float = 0.0
    """Seconds that earlier runs of this training took."""

    def weights(self) -> list[Weights]:
        """List the networks of the levels, coarse to fine."""
        return [level.weights for level in self.levels]

    def deltas(self) -> list[float]:
        """List the half widths of the levels' bands."""
        return [level.delta for level in self.levels]

    def and_then(self, weights: Weights, rough: tuple[float, float], record: dict[str, Any]) -> "Trained":
        """Return this with one more level, which is not measured. rough: its half width, and its largest gradient."""
        level = TrainedLevel(weights, *rough, DEFAULT_STEP_BOUND, DEFAULT_STEP_BOUND, record)
        return replace(self, levels=[*self.levels, level])

    def lower_band_bounds(self, bounds: Sequence[float]) -> None:
        """Lower the levels' bounds as bands to those that were measured when a finer level was traced."""
        for level, bound in zip(self.levels, bounds, strict=True):
            level.band_step_bound = min(level.band_step_bound, bound)


def training_record(network: tuple[int, int], omega: float, outcome: Outcome, began: float) -> dict[str, Any]:
    """Describe the training of a (width, depth) network for the provenance.

    began: the value of time.perf_counter() when its stage began.
    """
    width, depth = network
    return {
        "network": f"{width}x{depth}",
        "omega": omega,
        "steps": outcome.steps,
        "fraction": outcome.fraction,
        "restarts": outcome.restarts,
        "rate": outcome.rate,
        "loss": outcome.loss,
        "seconds": round(time.perf_counter() - began, 3),
    }


def unfinished_record(network: tuple[int, int], omega: float, snapshot: Snapshot, began: float) -> dict[str, Any]:
    """Describe the training of a network that is under way, as `training_record` does. snapshot: of `fit`."""
    width, depth = network
    counted = {key: snapshot.numbers[key] for key in ("steps", "fraction", "restarts", "rate", "loss")}
    return {"network": f"{width}x{depth}", "omega": omega, **counted, "seconds": round(time.perf_counter() - began, 3)}


def same_training(model: Model, settings: Settings) -> bool:
    """Whether a model was trained with these settings, all that makes a difference to its weights."""
    return _that_matter(model.provenance.get("settings")) == _that_matter(json.loads(json.dumps(asdict(settings))))


def _that_matter(settings: object) -> object:
    """Leave out of settings as the provenance has them how they are presented, where they ran and how long."""
    if not isinstance(settings, dict):
        return None
    timed = settings.get("seconds") is not None
    return {key: value for key, value in settings.items() if key not in NO_MATTER} | {"timed": timed}


def trained_model(
    trained: Trained,
    qualities: list[Quality] | None,
    field: FieldFigures | None,
    shape: Shape,
    settings: Settings,
    *,
    seconds: float,
    interrupted: bool,
) -> Model:
    """Put the model together that is saved.

    qualities: one for each level; None: nothing was measured. field: of all levels together, likewise. seconds: of all
    runs of this training. interrupted: whether it is not over.
    """
    first, finer = DEFAULT_ITERATIONS
    texture = trained.texture
    measured = [{}] * len(trained.levels) if qualities is None else [asdict(quality) for quality in qualities]
    return Model(
        name=shape.name,
        levels=tuple(
            Level(to_model(level.weights), level.delta, finer if i else first, *level.bounds())
            for i, level in enumerate(trained.levels)
        ),
        texture=None if texture is None else to_model(texture.weights),
        centre=shape.center,
        scale=shape.scale,
        up=settings.up or DEFAULT_UP,
        front=settings.front,
        credit=settings.credit,
        inputs="xyzt" if shape.moving else "xyz",
        provenance={
            "source": shape.source,
            "seed": settings.seed,
            "settings": json.loads(json.dumps(asdict(settings))),
            "seconds": round(seconds, 3),
            "interrupted": interrupted,
            "levels": [level.record | figures for level, figures in zip(trained.levels, measured, strict=True)],
            "field": None if field is None else json.loads(json.dumps(asdict(field))),
            "texture": None if texture is None else texture.record,
            "versions": {"torch": torch.__version__, "numpy": np.__version__},
        },
    )


def resumed(model: Model, shape: Shape, settings: Settings, device: torch.device) -> Trained:
    """Take over what is finished in a model, to go on with it.

    Raises UserError where the model does not say how it was trained, or does not fit the shape or the settings.
    """
    records = model.provenance.get("levels")
    if (
        not isinstance(records, list)
        or len(records) != len(model.levels)
        or any(_fraction(record) is None for record in records)
    ):
        raise UserError("--resume: this model does not say how it was trained; train a new one")
    if model.provenance.get("source") != shape.source:
        raise UserError("--resume: this model was trained on another shape; name another output with -o")
    present = [shape_of(level.network) for level in model.levels]
    asked = [f"{width}x{depth}" for width, depth in settings.networks]
    if present != asked[: len(present)]:
        raise UserError(f"--resume: the model has levels {','.join(present)}, --levels says {','.join(asked)}")
    trained = Trained(seconds=float(model.provenance.get("seconds", 0.0)))
    for level, record in zip(model.levels, records, strict=True):
        weights = [w.to(device) for w in from_model(level.network)]
        if (fraction := _fraction(record)) is not None and fraction < 1:
            trained.unfinished = Unfinished(weights, fraction)
            break
        trained.levels.append(
            TrainedLevel(weights, level.delta, level.lipschitz, level.step_bound, level.band_step_bound, record)
        )
    record = model.provenance.get("texture")
    if model.texture is not None and record and len(trained.levels) == len(asked) and _fraction(record) == 1:
        trained.texture = TrainedTexture([w.to(device) for w in from_model(model.texture)], record)
    return trained


def _fraction(record: object) -> float | None:
    """Read the share of its schedule that a network has done from its record; None where it does not say."""
    fraction = record.get("fraction") if isinstance(record, dict) else None
    return float(fraction) if isinstance(fraction, int | float) else None
