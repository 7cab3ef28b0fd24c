"""The verbs `render` and `view`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..codegen.targets.uniforms import OLD_SHADES
from ..model.endings import MESH_NAMES
from ..model.errors import UserError
from ..model.gallery import model_help, model_path
from ..model.options import argument, option
from ..model.verb import Verb, force_option, output_option
from .options import SHADES, PictureOptions, ViewerOptions

if TYPE_CHECKING:
    from .draw.camera import Camera
    from .draw.movie import Shot
    from .draw.renderer import Renderer
    from .state.source import Source

EMPTY_PICTURE = (
    "mplicits: note: the shape is not in the picture: the camera is inside it, or looks past it; "
    "--camera AZ,EL alone, without a distance, shows all of it"
)


@dataclass(frozen=True)
class RenderCommand(PictureOptions):
    """Command line of `render`."""

    model: Path = argument("M", model_help(), model_path)
    output: Path | None = output_option(
        "P.png", "picture (default: the model's name, .png), or video (--frames; default: .mp4)"
    )
    force: bool = force_option()
    frames: int | None = option(
        None,
        "draw a video of N pictures instead (-o movie.mp4 or .gif): the motion there and back of a model that moves, "
        "a turn around any other",
        metavar="N",
        least=1,
        most=10_000,
    )
    fps: int | None = option(None, "pictures of a video in a second (default: 30)", metavar="N", least=1, most=60)
    once: bool = option(False, "show a motion from time 0 to 1, without the way back")
    turn: float | None = option(
        None,
        "degrees by which the camera goes around in a video (default: 0 where the model moves, else 360)",
        metavar="DEGREES",
        least=-1_000_000,
        most=1_000_000,
    )
    benchmark: int | None = option(
        None,
        "then draw N more frames of one ray per pixel, and print the median of frames per second",
        metavar="N",
        least=1,
        study=True,
    )
    json: bool = option(False, "print one JSON object")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.frames is None and (flags := self.changed("fps", "once", "turn")):
            raise UserError(f"{flags}: of a video; it needs --frames N, the number of its pictures")
        if self.frames is not None and (flags := self.changed("benchmark", "transparent")):
            raise UserError(f"{flags}: of a single picture; leave out --frames")

    def shot(self, moving: bool) -> "Shot | None":
        """Return the video of --frames; None for a picture. moving: whether the model moves. Raises UserError."""
        from .draw.movie import Shot

        if self.frames is None:
            return None
        if self.once and not moving:
            raise UserError("--once: of a motion; this model does not move")
        if self.time:
            raise UserError("--time: one moment; --frames shows all of them")
        if self.mesh is not None and moving:
            raise UserError("--mesh: it does not move as the model does; leave out --frames, and choose its --time")
        turn = self.turn if self.turn is not None else 0.0 if moving else 360.0
        return Shot(self.frames, self.fps or 30, turn, moving, self.once)


@dataclass(frozen=True)
class ViewCommand(ViewerOptions):
    """Command line of `view`."""

    model: Path = argument("M", f"{model_help()}; or a shader that `bake --target glsl330` wrote (.glsl)", model_path)
    size: int | str | tuple[int, int] = option("1120x720", "pixels of the window, WxH or N", metavar="WxH")
    shade: str = option("softbox", "shading", choices=SHADES, old=OLD_SHADES)
    mesh: str | Path | None = option(
        None, f"mesh ({MESH_NAMES}) whose edges and faces the panel can show", metavar="LOW.ply"
    )
    watch: bool = option(False, "load the file again when it changes")


def _render(command: RenderCommand) -> None:
    """Draw a model to a PNG or a video, without a window. Raises UserError."""
    import json
    import sys
    import time

    from ..model.model_file import load
    from .draw.screenshot import save_png
    from .picture import set_up
    from .video import write_video

    output = _output(command)
    model = load(command.model)
    moving, size = model.inputs == "xyzt", command.pixels
    shot = command.shot(moving)
    rays = command.rays() * (command.frames or 1) + size[0] * size[1] * (command.benchmark or 0)
    with set_up(model, command, rays, once=True) as setup:
        renderer, camera, options = setup.renderer, setup.camera, setup.options
        level, normal_level = options.resolved_levels(len(model.levels))
        steps, rounds = renderer.schedule(options) if command.mesh is None else ((), 0)
        if command.mesh is None and rounds < (wanted := renderer.wanted_rounds(options)):
            print(
                f"mplicits: note: {rounds} rounds of {','.join(map(str, steps[:level]))} steps, not {wanted} rounds: "
                "software OpenGL's loop limit allows no more",
                file=sys.stderr,
            )
        start = time.perf_counter()
        if shot is None:
            image = renderer.render(size, camera, options)
            coverage, frame_seconds = float(image[..., 3].mean()), time.perf_counter() - start
            save_png(output, image, model.name, command.transparent)
        else:
            coverage = write_video(renderer, output, size, shot, camera, options)
            frame_seconds = (time.perf_counter() - start) / shot.frames
        mean_samples = renderer.drawn / (size[0] * size[1] * (command.frames or 1))
        rate = None if command.benchmark is None else _frames_per_second(renderer, command, camera)
    if not coverage:
        print(EMPTY_PICTURE, file=sys.stderr)
    report = {
        "output": str(output),
        "width": size[0],
        "height": size[1],
        "samples": command.samples,
        "mean_samples": round(mean_samples, 3),
        "shade": command.shade,
        "time": command.time if moving and shot is None else None,
        "frames": None if shot is None else shot.frames,
        "fps": None if shot is None else shot.rate,
        "mesh": None if command.mesh is None else str(command.mesh),
        "level": level if command.mesh is None else None,
        "normal_level": normal_level,
        "split": command.split,
        "rounds": rounds,
        "context": renderer.context.kind,
        "renderer": renderer.context.renderer,
        "coverage": round(coverage, 6),
        "compile_seconds": round(renderer.compile_seconds, 3),
        "frame_seconds": round(frame_seconds, 3),
        "frames_per_second": rate,
    }
    print(json.dumps(report) if command.json else _summary(report, command.benchmark))


def _summary(report: dict[str, Any], benchmark: int | None) -> str:
    """Format a report as one line. benchmark: number of frames that were timed."""
    from ..model.files import show

    video = f"{report['frames']} pictures, {report['fps']} a second, " if report["frames"] else ""
    line = (
        f"{show(report['output'])}: {video}{report['width']}x{report['height']}, "
        f"{report['mean_samples']:.3g} samples a pixel, {report['context']} on {report['renderer']}; "
        f"compiled in {report['compile_seconds']:.2f} s, "
        f"drawn in {report['frame_seconds']:.2f} s{' each' if video else ''}"
    )
    if report["frames_per_second"] is not None:
        line += f"; {report['frames_per_second']:.4g} frames per second, median of {benchmark}"
    return line


def _view(command: ViewCommand) -> None:
    """Show the desktop window until the user closes it. Raises UserError.

    The window opens before numpy and the model are loaded, unless the file cannot be a model.
    """
    from ..model.files import show

    source = None if _may_be_model(command.model) else _open_source(command)
    from .window.greeting import greeted

    background = command.colors and command.colors[1]
    with greeted(show(command.model.stem), command.pixels, background) as (context, gui):
        from .state.overlay import MeshSource
        from .window.window import Window

        source = source or _open_source(command)
        command.check_time(source.name, source.shader.moving)
        mesh = (
            None if command.mesh is None else MeshSource(Path(command.mesh), command.space or "input", command.follow)
        )
        camera = command.view_from(source.front)
        window = Window(context, gui, source, camera, command, storage=command.storage, watch=command.watch, mesh=mesh)
        try:
            window.loop()
        finally:
            window.close()


def _may_be_model(path: Path) -> bool:
    """Whether a file begins as model files do; reads a few bytes."""
    import os

    from ..model.files import is_file
    from ..model.kinds import MODEL, is_other

    return is_file(path) and os.access(path, os.R_OK) and not is_other(path, MODEL)


def _open_source(command: ViewCommand) -> "Source":
    """Read the model or the shader. Raises UserError."""
    from .state.source import open_source

    return open_source(command.model, command.storage)


def _output(command: RenderCommand) -> Path:
    """Return the path of the picture or video. Raises UserError where it cannot, or must not, be written."""
    from ..model.files import check_writable
    from ..model.kinds import PICTURE, VIDEO
    from .draw.movie import check_movie
    from .draw.screenshot import check_name

    is_video = command.frames is not None
    output = command.output or Path(command.model.stem + (".mp4" if is_video else ".png"))
    if is_video:
        check_movie(output, command.pixels)
    else:
        check_name(output)
    reads = [command.model, *([] if command.mesh is None else [Path(command.mesh)])]
    check_writable(output, reads, kind=VIDEO if is_video else PICTURE, force=command.force)
    return output


def _frames_per_second(renderer: "Renderer", command: RenderCommand, camera: "Camera") -> float:
    """Return the median rate of --benchmark frames, after a tenth as many to warm up."""
    import statistics

    from tqdm import tqdm

    frames = command.benchmark or 1
    warm_up = frames // 10 + 1
    bar = tqdm(range(warm_up + frames), desc="benchmark", delay=2, leave=False, disable=None)
    options = command.for_levels(renderer.shader.levels)
    seconds = [renderer.timed(command.pixels, camera, options)[0] for _ in bar]
    return float(f"{1 / statistics.median(seconds[warm_up:]):.4g}")


VERBS = (
    Verb(
        "render",
        "draw a model to a PNG or a video, without a window",
        RenderCommand,
        "render spot --size 1024 -o spot.png",
        _render,
    ),
    Verb("view", "look at a model in a window", ViewCommand, "view spot", _view),
)
