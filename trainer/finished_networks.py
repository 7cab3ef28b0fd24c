"""The finished networks of a training, how they become a model, and how `--resume` reads them from one."""

import json
import time
from collections.abc import Sequence, Set
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeGuard

import numpy as np
import torch

from ..model.errors import UserError
from ..model.field_figures import FieldFigures
from ..model.model import DEFAULT_ITERATIONS, DEFAULT_STEP_BOUND, Level, Model, size_text
from ..model.orientation import DEFAULT_UP
from ..model.surface_figures import SurfaceRecord
from ..model.value_types import fits
from .held_out_errors import Quality
from .networks.fit import Outcome
from .networks.network import Weights, from_model, to_model
from .networks.snapshot import Snapshot
from .settings import Settings
from .shapes.shape import Shape

MAY_CHANGE = {"wish", "up", "front", "credit", "device", "seconds"}
"""Settings that `--resume` may change; `up` is also part of the shape, which must be the same. Files
of before 2026-11-28 have `wish`."""
COUNTED = ("steps", "fraction", "restarts", "rate", "loss")
"""The record of the optimization of a network."""


@dataclass
class TrainedLevel:
    """A trained level, which stays frozen."""

    weights: Weights
    delta: float
    """Half-width of its band, model units (Eq. 5)."""
    lipschitz: float
    """Largest |grad f_i| measured in its domain."""
    step_bound: float
    """Largest factor on its steps with which no ray passes through the shape, where it is the last level traced."""
    band_step_bound: float
    """The same where a finer level is traced; 1 without a finer level."""
    record: dict[str, Any]
    """Its provenance; see `training_record`."""

    def bounds(self) -> tuple[float, float, float]:
        """Return the bounds in the order of `Level`."""
        return self.lipschitz, self.step_bound, self.band_step_bound


@dataclass
class TrainedTexture:
    """A trained texture network."""

    weights: Weights
    record: dict[str, Any]
    """Its provenance; see `training_record`."""


@dataclass
class Unfinished:
    """The last level of an interrupted training."""

    weights: Weights
    fraction: float
    """Share of its schedule that is done."""


@dataclass
class Trained:
    """The finished networks of a training."""

    levels: list[TrainedLevel] = field(default_factory=list)
    texture: TrainedTexture | None = None
    unfinished: Unfinished | None = None
    """The level after `levels`, where an interrupted training left it unfinished."""
    seconds: float = 0.0
    """Seconds that earlier runs of this training took."""

    def weights(self) -> list[Weights]:
        """List the networks of the levels, coarse to fine."""
        return [level.weights for level in self.levels]

    def deltas(self) -> list[float]:
        """List the half-widths delta of the levels' bands."""
        return [level.delta for level in self.levels]

    def and_then(self, weights: Weights, rough: tuple[float, float], record: dict[str, Any]) -> "Trained":
        """Return a copy with one more, roughly measured level. rough: its delta, and its largest gradient."""
        level = TrainedLevel(weights, *rough, DEFAULT_STEP_BOUND, DEFAULT_STEP_BOUND, record)
        return replace(self, levels=[*self.levels, level])

    def lower_band_bounds(self, bounds: Sequence[float]) -> None:
        """Lower the levels' bounds as bands to those measured along with a finer level."""
        for level, bound in zip(self.levels, bounds, strict=True):
            level.band_step_bound = min(level.band_step_bound, bound)


def training_record(size: str, omega: float, outcome: Outcome, began: float) -> dict[str, Any]:
    """Return the provenance of a trained network. size: as "64x2". began: time.perf_counter() at the stage's start."""
    counted = {key: getattr(outcome, key) for key in COUNTED}
    return {"network": size, "omega": omega, **counted, "seconds": round(time.perf_counter() - began, 3)}


def unfinished_record(size: str, omega: float, snapshot: Snapshot, began: float) -> dict[str, Any]:
    """Return the provenance of a network in training, as `training_record` does. snapshot: a `FitState.snapshot`."""
    counted = {key: snapshot.numbers[key] for key in COUNTED}
    return {"network": size, "omega": omega, **counted, "seconds": round(time.perf_counter() - began, 3)}


def same_training(model: Model, settings: Settings, but: Set[str] = frozenset()) -> bool:
    """Whether a model was trained with the same settings, as far as they affect its weights. but: others to ignore."""
    present = json.loads(json.dumps(asdict(settings)))
    return _affecting_weights(model.provenance.get("settings"), but) == _affecting_weights(present, but)


def _affecting_weights(settings: object, but: Set[str]) -> object:
    """Return the settings of a provenance that affect the weights."""
    if not isinstance(settings, dict):
        return None
    timed = settings.get("seconds") is not None
    return {key: value for key, value in settings.items() if key not in MAY_CHANGE | but} | {"timed": timed}


def trained_model(
    trained: Trained,
    qualities: list[Quality] | None,
    field: FieldFigures | None,
    surface: SurfaceRecord | None,
    shape: Shape,
    settings: Settings,
    *,
    seconds: float,
    interrupted: bool,
) -> Model:
    """Return the model of the finished networks.

    qualities: one for each level; None: not measured. field: figures of the nested field; None: not measured. surface:
    figures of its surface; None: not measured. seconds: of all runs of this training. interrupted: whether the training
    is unfinished.
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
        center=shape.center,
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
            "surface": None if surface is None else surface.to_json(),
            "texture": None if texture is None else texture.record,
            "versions": {"torch": torch.__version__, "numpy": np.__version__},
        },
    )


def resumed(model: Model, shape: Shape, settings: Settings, device: torch.device) -> Trained:
    """Read the finished networks of a model, to resume its training.

    Raises UserError where the model lacks the records of its training, or does not fit the shape or the settings.
    """
    records = model.provenance.get("levels")
    if not isinstance(records, list) or len(records) != len(model.levels) or not all(map(_is_record, records)):
        raise UserError("--resume: this model has no record of its training; train a new one")
    if model.provenance.get("source") != shape.source:
        raise UserError("--resume: this model was trained on another shape; name another output with -o")
    present = [size_text(level.network) for level in model.levels]
    wanted = [f"{width}x{depth}" for width, depth in settings.networks]
    if present != wanted[: len(present)]:
        raise UserError(f"--resume: the model has levels {','.join(present)}, --levels says {','.join(wanted)}")
    seconds = model.provenance.get("seconds", 0.0)
    trained = Trained(seconds=float(seconds) if fits(seconds, float) else 0.0)
    for level, record in zip(model.levels, records, strict=True):
        weights = [w.to(device) for w in from_model(level.network)]
        if record["fraction"] < 1:
            trained.unfinished = Unfinished(weights, record["fraction"])
            break
        trained.levels.append(
            TrainedLevel(weights, level.delta, level.lipschitz, level.step_bound, level.band_step_bound, record)
        )
    record = model.provenance.get("texture")
    complete = len(trained.levels) == len(wanted) and _is_record(record) and record["fraction"] == 1
    if model.texture is not None and complete and record:
        trained.texture = TrainedTexture([w.to(device) for w in from_model(model.texture)], record)
    return trained


def _is_record(record: object) -> TypeGuard[dict[str, Any]]:
    """Whether a value is what `training_record` returns: the file may hold anything."""
    if not isinstance(record, dict) or not isinstance(record.get("network"), str):
        return False
    numbers = [record.get(key) for key in (*COUNTED, "omega", "seconds")]
    return all(fits(number, float) for number in numbers) and 0 <= record["fraction"] <= 1
