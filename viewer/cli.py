"""The viewer's verbs: render, view."""

import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from codegen.errors import UserError
from codegen.gallery import model_path
from codegen.verb import MODEL_HELP, Verb

SHADES = ("phong", "normal", "texture", "depth", "steps")
CONTEXTS = ("auto", "osmesa", "egl", "window")


def render_arguments(parser: ArgumentParser) -> None:
    """Fills the parser of `render`."""
    _model_arguments(parser)
    parser.add_argument("-o", "--output", type=Path, metavar="P.png", help="picture (default: the model's name, .png)")
    parser.add_argument("--context", choices=CONTEXTS, default="auto",
                        help="egl (a GPU, else software), osmesa (software), window (hidden); auto: what works")
    parser.add_argument("--samples", type=_count, default=4, metavar="N", help="rays per pixel (default 4)")
    parser.add_argument("--transparent", action="store_true", help="no background: alpha is coverage")
    parser.add_argument("--mesh", type=Path, metavar="LOW.ply",
                        help="draw this mesh (PLY OBJ STL GLB) instead, with the normals of --normal-level")
    parser.add_argument("--space", choices=("input", "model"),
                        help="of the mesh: coordinates of the shape trained on, or of the unit sphere (default: input)")
    parser.add_argument("--split", action="store_true",
                        help="left half: own normals, of --level or the mesh; right half: those of --normal-level")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def view_arguments(parser: ArgumentParser) -> None:
    """Fills the parser of `view`."""
    _model_arguments(parser)


def run_render(args: Namespace) -> None:
    """`mplicits render`: a model file to a PNG, without a window."""
    import json
    import sys
    import time

    from codegen.files import check_writable, show
    from codegen.glsl330 import bake

    from .context import open_context
    from .rasteriser import Rasteriser
    from .renderer import Renderer, check_size
    from .screenshot import check_name, save_png

    output = args.output or Path(args.model.stem + ".png")
    check_size(args.size)
    check_name(output)
    check_writable(output)
    _check_mesh_options(args)
    camera = _camera(args)
    options = _options(args, samples=args.samples, transparent=args.transparent, split=0.5 * args.split)
    model = _load(args)
    level, normal_level = options.traced(len(model.levels))
    if args.split and args.mesh is None and level == normal_level:
        raise UserError(f"--split: both halves would have the normals of level {level}; lower --level")
    mesh = None if args.mesh is None else _mesh(args, model)
    context = open_context(args.context)
    try:
        if sys.stderr.isatty():
            print(f"compiling the shader on {context.renderer}", end="\r", file=sys.stderr, flush=True)
        renderer = (Renderer(context, bake(model, args.storage)) if mesh is None
                    else Rasteriser(context, model, mesh, args.storage))
        if sys.stderr.isatty():
            print("\x1b[K", end="", file=sys.stderr, flush=True)
        steps, rounds = renderer.schedule(options)
        if mesh is None and rounds < (wanted := renderer.wanted_rounds(options)):
            print(f"mplicits: note: {rounds} rounds of {','.join(map(str, steps[:level]))} steps, not {wanted} rounds: "
                  "software OpenGL's loop limit allows no more", file=sys.stderr)
        start = time.perf_counter()
        image = renderer.render(args.size, camera, options)
        seconds = time.perf_counter() - start
        save_png(output, image, model.name, args.transparent)
        compile_seconds = renderer.compile_seconds
        renderer.release()
    finally:
        context.release()
    width, height = args.size
    if args.json:
        print(json.dumps({
            "output": str(output), "width": width, "height": height, "samples": args.samples, "shade": args.shade,
            "mesh": None if mesh is None else str(args.mesh), "level": level if mesh is None else None,
            "normal_level": normal_level, "split": args.split, "rounds": rounds if mesh is None else 0,
            "context": context.kind, "renderer": context.renderer, "coverage": round(float(image[..., 3].mean()), 6),
            "compile_seconds": round(compile_seconds, 3), "frame_seconds": round(seconds, 3),
        }))
    else:
        print(f"{show(output)}: {width}x{height}, {args.samples} samples, {context.kind} on {context.renderer}; "
              f"compiled in {compile_seconds:.2f} s, drawn in {seconds:.2f} s")


def run_view(args: Namespace) -> None:
    """`mplicits view`: the desktop window."""
    from .renderer import check_size
    from .window import show_window

    check_size(args.size)
    show_window(_load(args), _camera(args), _options(args), args.size, args.storage)


def _model_arguments(parser: ArgumentParser) -> None:
    # -30,20 is a value, not an option: Python 3.14's rule, for the versions before it.
    parser._negative_number_matcher = re.compile(r"-\.?\d")
    parser.add_argument("model", type=model_path, metavar="M", help=MODEL_HELP)
    parser.add_argument("--size", type=_size, default=(512, 512), metavar="WxH", help="pixels, WxH or N (default 512)")
    parser.add_argument("--camera", type=_numbers(2, 3), metavar="AZ,EL,DIST",
                        help="degrees around, degrees above, distance in radii of the shape (default: it fits)")
    parser.add_argument("--fov", type=float, default=35.0, help="vertical field of view, degrees (default 35)")
    parser.add_argument("--level", type=int, metavar="L", help="last level traced (default: all)")
    parser.add_argument("--normal-level", type=int, metavar="L", help="level of the normals (default: that of --level)")
    parser.add_argument("--shade", choices=SHADES, default="phong", help="default phong")
    parser.add_argument("--iterations", type=_numbers(1, 64, int), metavar="20,5,5", help="steps at each level")
    parser.add_argument("--rounds", type=int, metavar="N", help="passes through the levels (default: the shader's)")
    parser.add_argument("--delta-scale", type=float, default=1.0, metavar="X", help="factor on the bands' widths")
    parser.add_argument("--step-scale", type=float, metavar="X", help="factor on the steps; below 1: safer, slower")
    parser.add_argument("--light", type=_numbers(3, 3), metavar="X,Y,Z",
                        help="direction towards the light: right, up, towards the viewer")
    parser.add_argument("--background", type=_colours, metavar="#RRGGBB[,#RRGGBB]", help="one colour, or top,bottom")
    parser.add_argument("--storage", choices=("auto", "literal", "texture"), default="auto",
                        help="how the shader holds the weights")


def _load(args: Namespace) -> Any:
    from codegen.model import load

    model = load(args.model)
    if args.shade == "texture" and model.texture is None:
        raise UserError("the model has no texture (it was trained without one); use --shade phong or normal")
    return model


def _check_mesh_options(args: Namespace) -> None:
    if args.mesh is None:
        if args.space is not None:
            raise UserError("--space: of the mesh's coordinates; it needs --mesh")
        return
    tracing = {
        "--level": args.level, "--iterations": args.iterations, "--rounds": args.rounds,
        "--step-scale": args.step_scale,
        "--delta-scale": None if args.delta_scale == 1.0 else args.delta_scale,
        "--shade steps": args.shade if args.shade == "steps" else None,
    }
    given = [name for name, value in tracing.items() if value is not None]
    if given:
        raise UserError(f"{', '.join(given)}: nothing is traced with --mesh; --normal-level chooses its normals")


def _mesh(args: Namespace, model: Any) -> Any:
    from .mesh_file import read_triangles

    centre, scale = ((0.0, 0.0, 0.0), 1.0) if args.space == "model" else (model.centre, model.scale)
    return read_triangles(args.mesh, centre, scale)


def _camera(args: Namespace) -> Any:
    from .camera import AZIMUTH, ELEVATION, Camera

    azimuth, elevation, *distance = args.camera or (AZIMUTH, ELEVATION)
    width, height = args.size
    return Camera(azimuth, elevation, distance[0] if distance else None, fov=args.fov, aspect=width / height)


def _options(args: Namespace, **more: Any) -> Any:
    from .options import RenderOptions

    return RenderOptions(
        level=args.level, normal_level=args.normal_level, shading=args.shade, iterations=args.iterations,
        rounds=args.rounds, delta_scale=args.delta_scale, step_scale=args.step_scale, light=args.light,
        background=args.background, **more,
    )


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and (height.isdecimal() or not height)) or len(text) > 20 or text.lower().endswith("x"):
        raise ArgumentTypeError(f"{text!r}: WxH in pixels, for example 640x480, or one number for a square")
    return int(width), int(height or width)


def _count(text: str) -> int:
    if not text.isdecimal():
        raise ArgumentTypeError(f"{text!r}: a whole number is needed")
    return int(text)


def _numbers(least: int, most: int, kind: type = float) -> Callable[[str], tuple[Any, ...]]:
    def parse(text: str) -> tuple[Any, ...]:
        try:
            numbers = tuple(kind(part) for part in text.split(","))
        except ValueError:
            numbers = ()
        if not least <= len(numbers) <= most:
            count = str(least) if least == most else f"{least} to {most}"
            raise ArgumentTypeError(f"{text!r}: {count} {'whole ' if kind is int else ''}numbers joined by commas")
        return numbers

    return parse


def _colours(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    try:
        colours = [tuple(byte / 255 for byte in bytes.fromhex(part.removeprefix("#"))) for part in text.split(",")]
    except ValueError:
        colours = []
    if len(colours) not in (1, 2) or any(len(colour) != 3 for colour in colours):
        raise ArgumentTypeError(f"{text!r}: RRGGBB, or RRGGBB,RRGGBB for top,bottom, for example ffffff")
    return colours[0], colours[-1]


VERBS = (
    Verb("render", "draw a model to a PNG, without a window", render_arguments, run_render),
    Verb("view", "look at a model in a window", view_arguments, run_view),
)
