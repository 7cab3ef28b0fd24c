"""A model, or a mesh, against its ground truth: what the verb `eval` does, without its lines of text."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ..model.errors import UserError
from ..model.field_figures import FieldFigures
from ..model.files import show
from ..model.model import Model
from .bar import Bar
from .distance import compare_field
from .eval_cli import DEFAULT_RESOLUTION
from .evaluate import Figures, compare
from .extract import check_resolution, extract_model, up_to
from .moment import chosen_time, place_at
from .parallel import Progress
from .surface import Mesh
from .truth import in_model_space, normalisation, read_mesh

FIELD_SAMPLES = 100_000
"""Most points that the field itself is measured at."""
BOX_DIFFERENCE = 0.2
"""Largest difference of the two bounding boxes' coordinates, model units, that needs no warning."""


@dataclass(frozen=True)
class Evaluation:
    """How far a reconstruction is from its ground truth. Lengths are in radii of the unit sphere."""

    figures: Figures
    """Of the surfaces."""
    field: FieldFigures | None
    """Of the field as a distance; None where a mesh was compared."""
    extraction: dict[str, float]
    """Grid, parameters, spurious components and seconds of the mesh that was made; empty where one was given."""


def evaluate(
    model: Model | Path,
    shape: Path,
    resolution: int | None = None,
    level: int | None = None,
    samples: int = 500_000,
    seed: int = 0,
    quiet: bool = False,
    time: float | None = None,
) -> Evaluation:
    """Compare a model, or the mesh in a file, with the mesh that is its ground truth (Section 4).

    The arguments are those of `mplicits eval`, with their names and defaults: resolution counts the cells along each
    side of the grid that the model's mesh is made in (None: 512), samples the points drawn on each surface; level: None
    for the last; seed decides the samples; quiet: show no progress bar; time: of a model that moves, from 0
    to 1 (None: 0). Raises UserError.
    """
    moment = 0.0
    if not 100 <= samples <= 100_000_000:
        raise UserError(f"--samples {samples}: a whole number from 100 to 100,000,000 is needed")
    if seed < 0:
        raise UserError(f"--seed {seed}: a whole number from 0 is needed")
    bar = Bar(quiet)
    extraction: dict[str, float] = {}
    try:
        if isinstance(model, Path):
            _check_no_grid(model, resolution, level, time)
            truth, ours = read_mesh(shape), read_mesh(model)
            space = normalisation(truth)
            reconstruction, true = in_model_space(ours, *space), in_model_space(truth, *space)
        else:
            model = up_to(model, level)
            moment = chosen_time(time, model)
            resolution = DEFAULT_RESOLUTION if resolution is None else resolution
            check_resolution(resolution)
            truth = read_mesh(shape)
            reconstruction, extraction = _extracted(model, resolution, bar, moment)
            true = in_model_space(truth, *place_at(model, moment))
        _warn(reconstruction, true)
        figures = compare(reconstruction, true, samples, seed, bar)
    finally:
        bar.end()
    if isinstance(model, Path):
        return Evaluation(figures, None, extraction)
    field = compare_field(model, true, min(samples, FIELD_SAMPLES), seed, moment)
    return Evaluation(figures, field, extraction)


def _check_no_grid(path: Path, resolution: int | None, level: int | None, time: float | None) -> None:
    """Raise UserError where options of an extraction are given for what is a mesh already."""
    for option, value in (("resolution", resolution), ("level", level), ("time", time)):
        if value is not None:
            raise UserError(f"--{option}: {show(path)} is a mesh already; leave the option out")


def _extracted(model: Model, resolution: int, progress: Progress, time: float) -> tuple[Mesh, dict[str, float]]:
    """Extract a model's surface. Returns it in model space, and what there is to say about it. Raises UserError."""
    began = perf_counter()
    extracted = extract_model(replace(model, texture=None), resolution, progress, time=time)
    return extracted.mesh, {
        "resolution": resolution,
        "parameters": model.parameters(),
        "spurious": extracted.spurious,
        "extraction_seconds": round(perf_counter() - began, 3),
    }


def _warn(ours: Mesh, truth: Mesh) -> None:
    """Warn on stderr, before the long work, where the two can hardly be the same shape in the same place."""
    boxes = [np.stack((mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))) for mesh in (ours, truth)]
    apart = np.abs(boxes[0] - boxes[1]).max()
    if apart > BOX_DIFFERENCE:
        print(
            f"warning: the bounding boxes of the two differ by {apart:.2g} radii of the unit sphere; are they of one "
            "shape, in the same place?",
            file=sys.stderr,
        )
