"""The arguments that `mplicits render` and `mplicits view` share, and what they make: a camera and options."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..codegen.targets.orbit import AZIMUTH, ELEVATION, FOV
from ..codegen.targets.uniforms import SCHEDULES
from ..model.errors import UserError
from ..model.gallery import model_path
from ..model.verb import take_negative_numbers

if TYPE_CHECKING:
    from .draw.camera import Camera
    from .draw.options import RenderOptions

SHADES = ("phong", "studio", "normal", "texture", "depth", "steps")
"""Choices of --shade, in the order of `--help`: all SHADINGS but "data", which is no picture."""


def model_arguments(parser: ArgumentParser, model_help: str, mesh_help: str) -> None:
    """Add the arguments that both verbs have. model_help, mesh_help: what `--help` says of M and of --mesh."""
    take_negative_numbers(parser)
    parser.add_argument("model", type=model_path, metavar="M", help=model_help)
    parser.add_argument(
        "--size", type=_size, default="512", metavar="WxH", help="pixels, WxH or N (default %(default)s)"
    )
    parser.add_argument(
        "--camera",
        type=_numbers(2, 3),
        metavar="AZ,EL,DIST",
        help="degrees around, degrees above, distance in radii of the shape "
        f"(default: {AZIMUTH:g},{ELEVATION:g}, or the front that the model names; it fits)",
    )
    parser.add_argument("--fov", type=float, default=FOV, help=f"vertical field of view, degrees (default {FOV:g})")
    parser.add_argument("--level", type=int, metavar="L", help="last level traced (default: all)")
    parser.add_argument("--normal-level", type=int, metavar="L", help="level of the normals (default: that of --level)")
    parser.add_argument("--shade", choices=SHADES, default="phong", help="default %(default)s")
    parser.add_argument("--iterations", type=_numbers(1, 64, int), metavar="20,5,5", help="steps at each level")
    parser.add_argument("--rounds", type=int, metavar="N", help="passes through the levels (default: the shader's)")
    parser.add_argument(
        "--schedule",
        choices=SCHEDULES,
        default=SCHEDULES[-1],
        help="how rays are traced: as the paper does, or in fewer steps (default %(default)s)",
    )
    parser.add_argument("--delta-scale", type=float, default=1.0, metavar="X", help="factor on the bands' widths")
    parser.add_argument("--step-scale", type=float, metavar="X", help="factor on the steps; below 1: safer, slower")
    parser.add_argument("--plain", action="store_true", help="without the model's colours")
    parser.add_argument(
        "--light",
        type=_numbers(3, 3),
        metavar="X,Y,Z",
        help="direction towards the light: right, up, towards the viewer",
    )
    parser.add_argument("--background", type=_colours, metavar="#RRGGBB[,#RRGGBB]", help="one colour, or top,bottom")
    parser.add_argument(
        "--samples",
        type=count,
        default=16,
        metavar="N",
        help="most rays of a pixel; one where it looks as its neighbours do (default 16)",
    )
    parser.add_argument("--uniform", action="store_true", help="all of them for every pixel")
    parser.add_argument(
        "--time", type=float, metavar="T", help="moment, from 0 to 1, of a model that moves (default 0)"
    )
    parser.add_argument("--mesh", type=Path, metavar="LOW.ply", help=mesh_help)
    parser.add_argument(
        "--space",
        choices=("input", "model"),
        help="of the mesh: coordinates of the shape trained on, or of the unit sphere (default: input)",
    )
    parser.add_argument(
        "--storage", choices=("auto", "literal", "texture"), default="auto", help="how the shader holds the weights"
    )


def check_space(args: Namespace) -> None:
    """Raise UserError where --space is given without --mesh."""
    if args.mesh is None and args.space is not None:
        raise UserError("--space: of the mesh's coordinates; it needs --mesh")


def check_time(args: Namespace, name: str, moving: bool) -> None:
    """Raise UserError where --time is given for a model that is not `moving`. name: the model's, as it may be shown."""
    if args.time is not None and not moving:
        raise UserError(f"--time: {name} does not move")


def camera_from(args: Namespace, front: tuple[float, float] | None) -> "Camera":
    """Return the `Camera` that the arguments ask for. front: the azimuth and elevation that the model names."""
    from .draw.camera import Camera

    azimuth, elevation, *distance = args.camera or front or (AZIMUTH, ELEVATION)
    width, height = args.size
    return Camera(azimuth, elevation, distance[0] if distance else None, fov=args.fov, aspect=width / height)


def options_from(args: Namespace, **more: Any) -> "RenderOptions":
    """Return the `RenderOptions` that the arguments ask for; `more` are options that only one verb has."""
    from .draw.options import RenderOptions

    return RenderOptions(
        level=args.level,
        normal_level=args.normal_level,
        shade=args.shade,
        iterations=args.iterations,
        rounds=args.rounds,
        schedule=args.schedule,
        delta_scale=args.delta_scale,
        step_scale=args.step_scale,
        light=args.light,
        background=args.background,
        plain=args.plain,
        samples=args.samples,
        uniform=args.uniform,
        time=args.time or 0.0,
        **more,
    )


def _size(text: str) -> tuple[int, int]:
    """Parse WxH or N into (width, height)."""
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and (height.isdecimal() or not height)) or len(text) > 20 or text.lower().endswith("x"):
        raise ArgumentTypeError(f"{text!r}: WxH in pixels, for example 640x480, or one number for a square")
    return int(width), int(height or width)


def count(text: str) -> int:
    """Parse a whole number of at least 0."""
    if not text.isdecimal():
        raise ArgumentTypeError(f"{text!r}: a whole number is needed")
    return int(text)


def _numbers(least: int, most: int, kind: type = float) -> Callable[[str], tuple[Any, ...]]:
    """Return a parser of `least` to `most` numbers of a kind, float or int, joined by commas."""

    def parse(text: str) -> tuple[Any, ...]:
        try:
            numbers = tuple(kind(part) for part in text.split(","))
        except ValueError:
            numbers = ()
        if not least <= len(numbers) <= most:
            wanted = str(least) if least == most else f"{least} to {most}"
            raise ArgumentTypeError(f"{text!r}: {wanted} {'whole ' if kind is int else ''}numbers joined by commas")
        return numbers

    return parse


def colours(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Parse one colour, or two joined by a comma, into (top, bottom), values in [0, 1]. Raises UserError."""
    try:
        parsed = [tuple(byte / 255 for byte in bytes.fromhex(part.removeprefix("#"))) for part in text.split(",")]
    except ValueError:
        parsed = []
    if len(parsed) not in (1, 2) or any(len(colour) != 3 for colour in parsed):
        raise UserError(f"{text!r}: RRGGBB, or RRGGBB,RRGGBB for top,bottom, for example ffffff")
    return parsed[0], parsed[-1]


def _colours(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Parse the argument of --background; see `colours`. Raises ArgumentTypeError."""
    try:
        return colours(text)
    except UserError as error:
        raise ArgumentTypeError(str(error)) from None
