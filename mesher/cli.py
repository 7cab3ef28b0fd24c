"""The mesher's verbs: `mesh` here, `eval` in eval_cli.py."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..model.gallery import model_help, model_path
from ..model.verb import Verb, output_arguments
from .eval_cli import DEFAULT_RESOLUTION, EVAL
from .moment import time_argument


def mesh_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `mesh` to a parser."""
    parser.add_argument("model", type=model_path, metavar="M", help=model_help())
    output_arguments(parser, "OUT", "mesh file: .ply .obj .stl .glb (default: the model's name, .ply)")
    parser.add_argument(
        "--resolution",
        type=int,
        default=DEFAULT_RESOLUTION,
        metavar="N",
        help=f"cells along each side of the grid (default {DEFAULT_RESOLUTION})",
    )
    parser.add_argument("--level", type=int, metavar="L", help="level whose surface is taken (default: the last)")
    parser.add_argument(
        "--no-cull",
        action="store_true",
        help="evaluate the last level at every vertex of the grid, keep what lies outside bands",
    )
    parser.add_argument(
        "--space",
        choices=("input", "model"),
        default="input",
        help="coordinates of the shape trained on, or of the unit sphere (default: input)",
    )
    time_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def run_mesh(args: Namespace) -> None:
    """Run `mplicits mesh`: write the surface of a model as a triangle mesh. Raises UserError."""
    import json
    from time import perf_counter

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH
    from ..model.model_file import load
    from .extract import check_resolution
    from .made import make_mesh
    from .write import check_suffix

    output = args.output or Path(args.model.stem + ".ply")
    check_suffix(output)
    check_resolution(args.resolution)
    check_writable(output, [args.model], kind=MESH, force=args.force)
    model = load(args.model)
    began = perf_counter()
    made = make_mesh(model, args.resolution, args.level, args.no_cull, args.space, args.quiet, args.time)
    seconds = perf_counter() - began
    write_whole(output, made.to_bytes(output.suffix.lower()))
    vertices, faces = len(made.vertices), len(made.faces)
    if args.json:
        print(
            json.dumps(
                {
                    "output": str(output),
                    "resolution": args.resolution,
                    "vertices": vertices,
                    "faces": faces,
                    "components": made.components,
                    "spurious": made.spurious,
                    "culled": not args.no_cull,
                    "seconds": round(seconds, 3),
                }
            )
        )
        return
    print(
        f"{show(output)}: {vertices:,} vertices, {faces:,} faces, {made.components} "
        f"component{'s' * (made.components != 1)}, {seconds:.1f} s"
    )
    if made.spurious:
        fate = "kept (--no-cull)" if args.no_cull else "removed"
        print(f"{made.spurious} spurious component{'s' * (made.spurious != 1)} outside the bands: {fate}")


VERBS = (
    Verb("mesh", "a model file becomes a triangle mesh", mesh_arguments, "mesh spot -o spot.glb", run_mesh, "mesh"),
    EVAL,
)
