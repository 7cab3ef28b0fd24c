"""The verb `eval`: its arguments, and how its figures are printed."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.gallery import model_path
from ..model.verb import Verb
from .moment import time_argument

if TYPE_CHECKING:
    from ..model.field_figures import FieldFigures
    from .evaluate import Figures

DEFAULT_RESOLUTION = 512
"""Cells along each side of the marching cubes' grid, as in the paper; `mesh` has the same default."""


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
    time_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def run_eval(args: Namespace) -> None:
    """Run `mplicits eval`: compare a model, or a mesh, with its ground truth. Raises UserError."""
    import json
    from dataclasses import asdict

    from ..model.files import show
    from ..model.mesh_file import SUFFIXES
    from ..model.model_file import load
    from .evaluation import evaluate

    other = args.model if args.model.suffix.lower() in SUFFIXES else load(args.model)
    evaluation = evaluate(
        other, args.shape, args.resolution, args.level, args.samples, args.seed, args.quiet, args.time
    )
    figures, field = evaluation.figures, evaluation.field
    if args.json:
        of_field = {} if field is None else {"field": asdict(field)}
        named = {"model": str(args.model), "shape": str(args.shape)}
        print(json.dumps(named | evaluation.extraction | asdict(figures) | of_field, indent=2))
        return
    print(f"{show(args.model)} against {show(args.shape)}; lengths in radii of the unit sphere")
    print("\n".join([*_lines(figures), *_field_lines(field)]))


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
