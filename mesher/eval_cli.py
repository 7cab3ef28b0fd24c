"""The verb `eval`: its arguments, and how its figures are printed."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.gallery import model_path
from ..model.verb import Verb

if TYPE_CHECKING:
    from ..model.field_figures import FieldFigures
    from ..model.model import Model
    from .evaluate import Figures
    from .parallel import Progress
    from .surface import Mesh

DEFAULT_RESOLUTION = 512
"""Cells along each side of the marching cubes' grid, as in the paper; `mesh` has the same default."""
FIELD_SAMPLES = 100_000
"""Most points that the field itself is measured at."""
BOX_DIFFERENCE = 0.2
"""Largest difference of the two bounding boxes' coordinates, model units, that needs no warning."""


def eval_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `eval` to a parser."""
    parser.add_argument(
        "model",
        type=model_path,
        metavar="M",
        help="model file (.safetensors), a name of the gallery, or a mesh to compare",
    )
    parser.add_argument("shape", type=Path, metavar="SHAPE", help="ground truth: a mesh, PLY OBJ STL GLB")
    parser.add_argument(
        "--resolution",
        type=int,
        metavar="N",
        help=f"cells along each side of the marching cubes' grid (default {DEFAULT_RESOLUTION})",
    )
    parser.add_argument("--level", type=int, metavar="L", help="level that is evaluated (default: the last)")
    parser.add_argument(
        "--samples", type=int, default=500_000, metavar="N", help="points sampled on each surface (default 500000)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="K", help="of the samples (default 0)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def run_eval(args: Namespace) -> None:
    """Run `mplicits eval`: compare a model, or a mesh, with its ground truth. Raises UserError."""
    import json
    from dataclasses import asdict

    from ..model.errors import UserError
    from ..model.files import show
    from .bar import Bar
    from .distance import compare_field
    from .evaluate import compare

    if not 100 <= args.samples <= 100_000_000:
        raise UserError(f"--samples {args.samples}: a whole number from 100 to 100,000,000 is needed")
    if args.seed < 0:
        raise UserError(f"--seed {args.seed}: a whole number from 0 is needed")
    bar = Bar(args.quiet)
    try:
        ours, truth, extraction, model = _meshes(args, bar)
        _warn(ours, truth)
        figures = compare(ours, truth, args.samples, args.seed, bar)
    finally:
        bar.end()
    field = None if model is None else compare_field(model, truth, min(args.samples, FIELD_SAMPLES), args.seed)
    if args.json:
        of_field = {} if field is None else {"field": asdict(field)}
        named = {"model": str(args.model), "shape": str(args.shape)}
        print(json.dumps(named | extraction | asdict(figures) | of_field, indent=2))
        return
    print(f"{show(args.model)} against {show(args.shape)}; lengths in radii of the unit sphere")
    print("\n".join([*_lines(figures), *_field_lines(field)]))


def _warn(ours: "Mesh", truth: "Mesh") -> None:
    """Warn on stderr, before the long work, where the two can hardly be the same shape in the same place."""
    import sys

    import numpy as np

    boxes = [np.stack((mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))) for mesh in (ours, truth)]
    apart = np.abs(boxes[0] - boxes[1]).max()
    if apart > BOX_DIFFERENCE:
        print(
            f"warning: the bounding boxes of the two differ by {apart:.2g} radii of the unit sphere; are they of one "
            "shape, in the same place?",
            file=sys.stderr,
        )


def _meshes(args: Namespace, progress: "Progress") -> "tuple[Mesh, Mesh, dict[str, float], Model | None]":
    """Make the two meshes that are compared. Raises UserError.

    Returns the reconstruction and the ground truth, both in model space, and what --json says about the extraction of
    the first, with its model: nothing and None where it is a mesh already.
    """
    import time
    from dataclasses import replace

    from ..model.errors import UserError
    from ..model.files import show
    from ..model.mesh_file import SUFFIXES
    from ..model.model import load
    from .extract import check_resolution, extract_model, up_to
    from .truth import in_model_space, normalisation, read_mesh

    if args.model.suffix.lower() in SUFFIXES:
        for option in ("resolution", "level"):
            if getattr(args, option) is not None:
                raise UserError(f"--{option}: {show(args.model)} is a mesh already; leave the option out")
        truth, ours = read_mesh(args.shape), read_mesh(args.model)
        space = normalisation(truth)
        return in_model_space(ours, *space), in_model_space(truth, *space), {}, None
    resolution = DEFAULT_RESOLUTION if args.resolution is None else args.resolution
    check_resolution(resolution)
    model = up_to(load(args.model), args.level)
    truth = read_mesh(args.shape)
    began = time.perf_counter()
    extracted = extract_model(replace(model, texture=None), resolution, progress)
    extraction = {
        "resolution": resolution,
        "parameters": model.parameters(),
        "spurious": extracted.spurious,
        "extraction_seconds": round(time.perf_counter() - began, 3),
    }
    return extracted.mesh, in_model_space(truth, *model.place), extraction, model


def _lines(figures: "Figures") -> list[str]:
    """Write the figures as lines for people."""
    ratio = figures.chamfer / figures.floor
    closed = "watertight" if figures.watertight else "not watertight"
    return [
        f"Chamfer, squared L2      {figures.chamfer:.3e}   {ratio:.2f} times the floor, {figures.floor:.3e}",
        f"Hausdorff                {figures.hausdorff:.3e}",
        f"distance to the truth    {figures.distance_mean:.3e} mean, {figures.distance_99:.3e} 99th percentile",
        f"distance of the truth    {figures.missing_mean:.3e} mean, {figures.missing_99:.3e} 99th percentile",
        f"normal angle             {figures.normal_angle:.2f} degrees, mean",
        f"IoU of 0.01 shells       {figures.iou:.4f}",
        f"components               {figures.components}, the truth has {figures.truth_components}; {closed}",
        f"mesh                     {figures.vertices:,} vertices, {figures.faces:,} faces",
        f"{figures.samples:,} samples on each side, seed {figures.seed}",
    ]


def _field_lines(field: "FieldFigures | None") -> list[str]:
    """Write what the field is as a distance as lines for people; nothing for a mesh, which has no field."""
    if field is None:
        return []
    from ..model.field_figures import written

    low, middle, high = field.gradient
    error, excess = written(field.domain_error, ".3e"), written(field.domain_excess, ".2%")
    return [
        f"field, in the ball       {error} mean error, too large at {excess}",
        f"field, in the last band  {written(field.band_error, '.3e')} mean error",
        f"|grad f| on the surface  {low:.2f}, {middle:.2f}, {high:.2f}: 10th, 50th and 90th percentile",
    ]


EVAL = Verb(
    "eval",
    "how far a model, or a mesh, is from its ground truth",
    eval_arguments,
    "eval bunny.safetensors bunny.ply",
    run_eval,
    "mesh",
)
