"""Compares a model, or a mesh, with its ground truth: the work of `eval`, without its messages."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ..model.errors import UserError
from ..model.field_figures import FieldFigures
from ..model.files import show
from ..model.model import Model
from ..model.surface_figures import SurfaceFigures, surface_record
from .at_time import chosen_time, place_at
from .compare import Figures, compare
from .distance import compare_field
from .extract import extract_model, up_to
from .options import RESOLUTION, EvalOptions
from .parallel import Progress
from .progress import Bar
from .read_meshes import in_model_space, normalization, read_mesh
from .surface import Mesh

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
    """Grid, parameters, spurious components and seconds of the extracted mesh; empty if the input is a mesh."""
    curved: SurfaceFigures | None = None
    """What the training measured, where it curved the faces of the mesh; `figures` are against the flat faces."""
    warning: str = ""
    """A line about invented surface."""


def evaluate(model: Model | Path, shape: Path, options: EvalOptions) -> Evaluation:
    """Compare a model, or the mesh in a file, with the mesh that is its ground truth (Section 4). Raises UserError."""
    time, samples, seed, thickness = 0.0, options.samples, options.seed, 0.0
    bar = Bar(options.quiet)
    extraction: dict[str, float] = {}
    try:
        if isinstance(model, Path):
            if flags := options.changed("resolution", "level", "time"):
                raise UserError(f"{flags}: {show(model)} is a mesh already; leave the option out")
            truth, ours = (read_mesh(path, follow=options.follow) for path in (shape, model))
            space = normalization(truth)
            reconstruction, true = in_model_space(ours, *space), in_model_space(truth, *space)
        else:
            model = up_to(model, options.level)
            time = chosen_time(options.time, model)
            truth = read_mesh(shape, follow=options.follow)
            reconstruction, extraction = _extracted(model, options.resolution or RESOLUTION, bar, time)
            true = in_model_space(truth, *place_at(model, time))
            thickness = _thickness(model)
        _warn(reconstruction, true)
        figures = compare(reconstruction, true, samples, seed, bar, thickness)
    finally:
        bar.end()
    if isinstance(model, Path):
        return Evaluation(figures, None, extraction)
    field = compare_field(model, true, min(samples, FIELD_SAMPLES), seed, time)
    record = surface_record(model.provenance)
    curved = None if record is None or record.flat is None or options.level is not None else record.shape
    warning = figures.surface().warning(open_mesh=not (figures.truth_watertight or thickness))
    return Evaluation(figures, field, extraction, curved, warning)


def _thickness(model: Model) -> float:
    """Return the distance from the mesh that a model of a sheet has by intention (`train --thicken`), model units."""
    source = model.provenance.get("source")
    share = source.get("thicken") if isinstance(source, dict) else None
    return share / (1 + share) if isinstance(share, float) and 0 < share <= 1 else 0.0


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
