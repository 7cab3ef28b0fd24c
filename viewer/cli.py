"""The verbs of the viewer on the command line: `mplicits render` and `mplicits view`."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..model.gallery import model_help
from ..model.verb import Verb, output_arguments
from .arguments import camera_from, check_space, check_time, count, model_arguments, options_from

if TYPE_CHECKING:
    from .draw.camera import Camera
    from .draw.options import RenderOptions
    from .draw.renderer import Renderer
    from .state.source import Source

CONTEXTS = ("auto", "osmesa", "egl", "window")
"""Choices of --context: the kinds that `open_context` knows."""


NOTHING_SEEN = (
    "mplicits: note: the shape is not in the picture: the camera is inside it, or looks past it; "
    "--camera AZ,EL alone, without a distance, shows all of it"
)


def render_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `mplicits render`."""
    model_arguments(
        parser, model_help(), "draw this mesh (PLY OBJ STL GLB) instead, with the normals of --normal-level"
    )
    output_arguments(parser, "P.png", "picture (default: the model's name, .png), or video, see --frames")
    parser.add_argument(
        "--context",
        choices=CONTEXTS,
        default="auto",
        help="egl (a GPU, else software), osmesa (software), window (hidden); auto: what works",
    )
    parser.add_argument("--transparent", action="store_true", help="no background: alpha is coverage")
    parser.add_argument(
        "--split",
        action="store_true",
        help="left half: own normals, of --level or the mesh; right half: those of --normal-level "
        "(default: level 1, and the last one)",
    )
    parser.add_argument(
        "--frames",
        type=count,
        metavar="N",
        help="a video of N pictures instead (-o movie.mp4 or .gif): the motion there and back of a model that moves, "
        "a turn around any other",
    )
    parser.add_argument("--fps", type=count, metavar="N", help="pictures of a video in a second (default 30)")
    parser.add_argument("--once", action="store_true", help="of a motion: from time 0 to 1, not back again")
    parser.add_argument(
        "--turn",
        type=float,
        metavar="DEGREES",
        help="by how much the camera goes around in a video (default: 0 where the model moves, else 360)",
    )
    parser.add_argument(
        "--benchmark",
        type=count,
        metavar="N",
        help="then draw N more frames of one ray per pixel, and print the median of frames per second",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def view_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `mplicits view`."""
    model_arguments(
        parser,
        model_help() + "; or a shader that `bake --target glsl330` wrote (.glsl)",
        "a mesh (PLY OBJ STL GLB) whose edges and faces the panel can show",
    )
    parser.set_defaults(size="1120x720", shade="studio")
    parser.add_argument("--watch", action="store_true", help="load the file again when it changes")


def run_render(args: Namespace) -> None:
    """Run `mplicits render`: draw a model file to a PNG or a video, without a window."""
    import json
    import sys
    import time
    from dataclasses import fields

    from ..model.errors import UserError
    from ..model.files import show
    from ..model.model_file import load
    from .draw.screenshot import save_png
    from .draw.tiles import check_size
    from .record import check_options, record, shot_from
    from .still import Asked, opened

    check_size(args.size)
    check_options(args)
    output = _output(args)
    if args.benchmark == 0:
        raise UserError("--benchmark 0: at least one frame is needed")
    asked = Asked(**{entry.name: getattr(args, entry.name) for entry in fields(Asked)})
    asked.check()
    model = load(args.model)
    check_time(args, show(model.name), model.inputs == "xyzt")
    shot = shot_from(args, model.inputs == "xyzt")
    rays = asked.rays() * (args.frames or 1) + args.size[0] * args.size[1] * (args.benchmark or 0)
    with opened(model, asked, rays, once=True) as scene:
        if scene.rounds < scene.wanted_rounds:
            print(
                f"mplicits: note: {scene.rounds} rounds of {','.join(map(str, scene.iterations))} steps, "
                f"not {scene.wanted_rounds} rounds: software OpenGL's loop limit allows no more",
                file=sys.stderr,
            )
        renderer, camera, options = scene.renderer, scene.camera, scene.options
        start = time.perf_counter()
        if shot is None:
            image = renderer.render(args.size, camera, options)
            coverage, frame_seconds = float(image[..., 3].mean()), time.perf_counter() - start
            save_png(output, image, model.name, args.transparent)
        else:
            coverage = record(renderer, output, args.size, shot, camera, options)
            frame_seconds = (time.perf_counter() - start) / shot.frames
        frames_per_second = None if args.benchmark is None else _frames_per_second(renderer, args, camera, options)
    if not coverage:
        print(NOTHING_SEEN, file=sys.stderr)
    report = {
        "output": str(output),
        "width": args.size[0],
        "height": args.size[1],
        "samples": args.samples,
        "shade": args.shade,
        "time": options.time if model.inputs == "xyzt" and shot is None else None,
        "frames": None if shot is None else shot.frames,
        "fps": None if shot is None else shot.rate,
        "mesh": None if args.mesh is None else str(args.mesh),
        "level": scene.level if args.mesh is None else None,
        "normal_level": scene.normal_level,
        "split": args.split,
        "rounds": scene.rounds,
        "context": renderer.context.kind,
        "renderer": renderer.context.renderer,
        "coverage": round(coverage, 6),
        "compile_seconds": round(renderer.compile_seconds, 3),
        "frame_seconds": round(frame_seconds, 3),
        "frames_per_second": frames_per_second,
    }
    print(json.dumps(report) if args.json else _line(report, args.benchmark))


def _line(report: dict[str, Any], benchmark: int | None) -> str:
    """Write the line that tells people what was drawn. benchmark: frames that were timed."""
    from ..model.files import show

    video = f"{report['frames']} pictures, {report['fps']} a second, " if report["frames"] else ""
    line = (
        f"{show(report['output'])}: {video}{report['width']}x{report['height']}, {report['samples']} samples, "
        f"{report['context']} on {report['renderer']}; compiled in {report['compile_seconds']:.2f} s, "
        f"drawn in {report['frame_seconds']:.2f} s{' each' if video else ''}"
    )
    if report["frames_per_second"] is not None:
        line += f"; {report['frames_per_second']:.4g} frames per second, median of {benchmark}"
    return line


def run_view(args: Namespace) -> None:
    """Run `mplicits view`: show the desktop window until the user closes it.

    The window opens before most is imported, but not for a file that cannot be a model.
    """
    from ..model.files import show
    from .draw.tiles import check_size

    check_size(args.size)
    check_space(args)
    source = None if _may_be_model(args.model) else _open_source(args)
    from .window.greeting import greeted

    background = None if args.background is None else args.background[1]
    with greeted(show(args.model.stem), args.size, background) as (context, gui):
        from .state.overlay import MeshSource
        from .window.window import Window

        source = source or _open_source(args)
        check_time(args, source.name, source.shader.moving)
        mesh = None if args.mesh is None else MeshSource(args.mesh, args.space or "input")
        camera, options = camera_from(args, source.front), options_from(args)
        window = Window(context, gui, source, camera, options, storage=args.storage, watch=args.watch, mesh=mesh)
        try:
            window.loop()
        finally:
            window.close()


def _may_be_model(path: Path) -> bool:
    """Whether a path is a file that begins as models do, which is seen at once; a shader does not."""
    import os

    from ..model.files import is_file
    from ..model.kinds import MODEL, is_other

    return is_file(path) and os.access(path, os.R_OK) and not is_other(path, MODEL)


def _open_source(args: Namespace) -> "Source":
    """Read the model or shader that the window is to show. Raises UserError."""
    from .state.source import open_source

    return open_source(args.model, args.storage)


def _output(args: Namespace) -> Path:
    """Return the path of the picture or video. Raises UserError where it cannot, or must not, be written."""
    from ..model.files import check_writable
    from ..model.kinds import PICTURE, VIDEO
    from ..model.mesh_file import mesh_files
    from .draw.movie import check_movie
    from .draw.screenshot import check_name

    output: Path = args.output or Path(args.model.stem + (".png" if args.frames is None else ".mp4"))
    if args.frames is None:
        check_name(output)
    else:
        check_movie(output, args.size)
    reads = [args.model, *([] if args.mesh is None else mesh_files(args.mesh))]
    check_writable(output, reads, kind=PICTURE if args.frames is None else VIDEO, force=args.force)
    return output


def _frames_per_second(renderer: "Renderer", args: Namespace, camera: "Camera", options: "RenderOptions") -> float:
    """Return the median rate of --benchmark frames, after a tenth as many to warm up."""
    import statistics

    from tqdm import tqdm

    warm_up = args.benchmark // 10 + 1
    frames = tqdm(range(warm_up + args.benchmark), desc="benchmark", delay=2, leave=False, disable=None)
    seconds = [renderer.timed(args.size, camera, options)[0] for _ in frames]
    return float(f"{1 / statistics.median(seconds[warm_up:]):.4g}")


VERBS = (
    Verb(
        "render",
        "draw a model to a PNG or a video, without a window",
        render_arguments,
        "render spot --size 1024 -o spot.png",
        run_render,
    ),
    Verb("view", "look at a model in a window", view_arguments, "view spot", run_view),
)
