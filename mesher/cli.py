"""The mesher's verbs: `mesh` here, `eval` in eval_cli.py."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..model.gallery import model_help, model_path
from ..model.verb import Verb, output_arguments
from .eval_cli import DEFAULT_RESOLUTION, EVAL


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
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def run_mesh(args: Namespace) -> None:
    """Run `mplicits mesh`: write the surface of a model as a triangle mesh. Raises UserError."""
    import json
    import time

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH
    from ..model.model import MODEL_SPACE, load
    from .bar import Bar
    from .extract import check_resolution, extract_model, up_to
    from .write import check_suffix, to_bytes

    output = args.output or Path(args.model.stem + ".ply")
    check_suffix(output)
    check_resolution(args.resolution)
    check_writable(output, [args.model], kind=MESH, force=args.force)
    model = up_to(load(args.model), args.level)
    bar = Bar(args.quiet)
    began = time.perf_counter()
    try:
        extracted = extract_model(model, args.resolution, bar, cull=not args.no_cull)
    finally:
        bar.end()
    seconds = time.perf_counter() - began
    place = model.place if args.space == "input" else MODEL_SPACE
    write_whole(output, to_bytes(extracted.mesh, output.suffix.lower(), *place))
    vertices, faces = len(extracted.mesh.vertices), len(extracted.mesh.faces)
    if args.json:
        print(
            json.dumps(
                {
                    "output": str(output),
                    "resolution": args.resolution,
                    "vertices": vertices,
                    "faces": faces,
                    "components": extracted.components,
                    "spurious": extracted.spurious,
                    "culled": not args.no_cull,
                    "seconds": round(seconds, 3),
                }
            )
        )
        return
    print(
        f"{show(output)}: {vertices:,} vertices, {faces:,} faces, {extracted.components} "
        f"component{'s' * (extracted.components != 1)}, {seconds:.1f} s"
    )
    if extracted.spurious:
        fate = "kept (--no-cull)" if args.no_cull else "removed"
        print(f"{extracted.spurious} spurious component{'s' * (extracted.spurious != 1)} outside the bands: {fate}")


VERBS = (
    Verb("mesh", "a model file becomes a triangle mesh", mesh_arguments, "mesh spot -o spot.glb", run_mesh, "mesh"),
    EVAL,
)
