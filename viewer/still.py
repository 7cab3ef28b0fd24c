"""One picture of a model, off screen: what the verb `render` does, without its files and its lines of text."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from ..codegen.targets.glsl330 import bake
from ..codegen.targets.orbit import AZIMUTH, ELEVATION, FOV
from ..codegen.targets.samples import SHARE
from ..codegen.targets.uniforms import SCHEDULES
from ..model.errors import UserError
from ..model.files import show
from ..model.model import Model
from .draw.camera import Camera
from .draw.compile import compile_quickly, compiling_dominates, storage_for
from .draw.context import Context, open_context
from .draw.options import RenderOptions
from .draw.rasterizer import Rasterizer
from .draw.renderer import Renderer
from .draw.supersampling import Image
from .draw.tiles import check_size
from .draw.triangles import read_triangles_for

Colour = tuple[float, ...]
"""Red, green and blue in [0, 1], sRGB."""

_DRAWING = threading.Lock()
"""One picture at a time: drivers differ in what they take from several threads at once."""


@dataclass(frozen=True)
class Asked:
    """What a picture is to show: the options of `mplicits render` (docs/viewer.md), with their names and defaults."""

    size: tuple[int, int] = (512, 512)
    """Width and height, pixels."""
    camera: tuple[float, ...] | None = None
    """Azimuth and elevation in degrees, and a distance in radii of the shape where three numbers are given."""
    fov: float = FOV
    """Vertical field of view, degrees."""
    level: int | None = None
    """The last level that is traced; None: all are."""
    normal_level: int | None = None
    """The level of the normals; None: that of `level`."""
    shade: str = "phong"
    """One of the shadings."""
    iterations: tuple[int, ...] | None = None
    """Steps at each level; None: the model's own."""
    rounds: int | None = None
    """Passes through the levels; None: the shader's."""
    schedule: str = SCHEDULES[-1]
    """How rays are traced."""
    delta_scale: float = 1.0
    """Factor on the bands' widths."""
    step_scale: float | None = None
    """Factor on the steps."""
    plain: bool = False
    """Whether the model's colours are left out."""
    light: tuple[float, float, float] | None = None
    """Direction towards the light: right, up, towards the viewer."""
    background: tuple[Colour, Colour] | None = None
    """Colours at the top and at the bottom."""
    samples: int = 16
    """Most rays of a pixel; where it looks as its neighbours do, one."""
    uniform: bool = False
    """Whether every pixel has all of them."""
    time: float | None = None
    """The moment, of a model that moves."""
    mesh: Path | None = None
    """A mesh that is drawn in place of the model, with the normals of `normal_level`."""
    space: str | None = None
    """Of that mesh's coordinates: "input", where None is given, or "model"."""
    storage: str = "auto"
    """How the shader holds the weights."""
    context: str = "auto"
    """Kind of the OpenGL context."""
    transparent: bool = False
    """Whether the background is left out, and alpha is coverage."""
    split: bool = False
    """Whether the left half has the normals of `level`, and the right half those of `normal_level`."""

    def check(self) -> None:
        """Raise UserError where options do not fit one another."""
        check_size(self.size)
        if self.mesh is None:
            if self.space is not None:
                raise UserError("--space: of the mesh's coordinates; it needs --mesh")
            return
        tracing = {
            "--level": self.level,
            "--iterations": self.iterations,
            "--rounds": self.rounds,
            "--step-scale": self.step_scale,
            "--delta-scale": None if self.delta_scale == 1.0 else self.delta_scale,
            "--shade steps": self.shade if self.shade == "steps" else None,
        }
        given = [name for name, value in tracing.items() if value is not None]
        if given:
            raise UserError(f"{', '.join(given)}: nothing is traced with --mesh; --normal-level chooses its normals")

    def rays(self) -> int:
        """Return about how many rays the picture takes."""
        each = self.samples * (1.0 if self.uniform or self.mesh is not None else SHARE)
        return round(self.size[0] * self.size[1] * max(1.0, each))

    def options(self) -> RenderOptions:
        """Return the renderer's options. Raises UserError where one is out of range."""
        return RenderOptions(
            level=self.level,
            normal_level=self.normal_level,
            shade=self.shade,
            iterations=self.iterations,
            rounds=self.rounds,
            schedule=self.schedule,
            delta_scale=self.delta_scale,
            step_scale=self.step_scale,
            light=self.light,
            background=None if self.background is None else (_colour(self.background[0]), _colour(self.background[1])),
            plain=self.plain,
            samples=self.samples,
            uniform=self.uniform,
            time=self.time or 0.0,
            transparent=self.transparent,
            split=0.5 * self.split,
        )


@dataclass(frozen=True, eq=False)
class Scene:
    """A model, ready to be drawn."""

    renderer: Renderer
    """With its shader compiled, in a context that is open."""
    camera: Camera
    """Of the picture."""
    options: RenderOptions
    """Of the picture."""
    level: int
    """The last level that is traced."""
    normal_level: int
    """The level of the normals."""
    iterations: tuple[int, ...]
    """Steps at each level and round."""
    rounds: int
    """Passes through the levels; 0 where a mesh is drawn."""
    wanted_rounds: int
    """Passes that were asked for; software OpenGL may allow fewer."""


@contextmanager
def opened(model: Model, asked: Asked, rays: int, once: bool = False) -> Iterator[Scene]:
    """Open an OpenGL context, compile what draws a model, and close both afterwards.

    rays: of all pictures that will be drawn. once: whether the process draws nothing else, so that few of them need no
    optimised program (`compile_quickly`). Raises UserError where the options do not fit the model or one another, or
    where OpenGL fails. One thread at a time is inside.
    """
    asked.check()
    options = asked.options()
    if asked.time is not None and model.inputs != "xyzt":
        raise UserError(f"--time: {show(model.name)} does not move")
    camera = _camera(asked.camera or model.front or (AZIMUTH, ELEVATION), asked.fov, asked.size[0] / asked.size[1])
    options.check_texture(model.coloured)
    if asked.split and asked.mesh is None:
        options = _two_levels(options, len(model.levels))
    level, normal_level = options.resolved_levels(len(model.levels))
    triangles = None if asked.mesh is None else read_triangles_for(model, asked.mesh, asked.space or "input")
    if once and compiling_dominates(rays, model.parameters()):
        compile_quickly()
    with _DRAWING:
        context = open_context(asked.context)
        try:
            stored = storage_for(asked.storage, rays, model.parameters(), context.software)
            with _Announced(context):
                if triangles is None:
                    renderer = Renderer(context, bake(model, stored, passes=True), options.shade)
                else:
                    renderer = Rasterizer(context, model, triangles, stored)
            steps, rounds = ((), 0) if triangles is not None else renderer.schedule(options)
            wanted = 0 if triangles is not None else renderer.wanted_rounds(options)
            yield Scene(renderer, camera, options, level, normal_level, steps[:level], rounds, wanted)
            renderer.release()
        finally:
            context.release()


def draw_still(model: Model, asked: Asked) -> Image:
    """Draw a picture of a model: (H, W, 4) float32, sRGB and coverage, top row first. Raises UserError as `opened`."""
    with opened(model, asked, asked.rays()) as scene:
        return scene.renderer.render(asked.size, scene.camera, scene.options)


class _Announced:
    """Says on a terminal, meanwhile, that a shader is compiled."""

    def __init__(self, context: Context) -> None:
        self._driver, self._terminal = context.renderer, sys.stderr is not None and sys.stderr.isatty()

    def __enter__(self) -> None:
        if self._terminal:
            print(f"compiling the shader on {self._driver}", end="\r", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._terminal:
            print("\x1b[K", end="", file=sys.stderr, flush=True)


def _camera(place: tuple[float, ...], fov: float, aspect: float) -> Camera:
    """Make the camera of (azimuth, elevation) or (azimuth, elevation, distance). Raises UserError."""
    if len(place) not in (2, 3):
        raise UserError(f"camera: {len(place)} numbers; azimuth and elevation are needed, and a distance may follow")
    azimuth, elevation, *distance = place
    return Camera(azimuth, elevation, distance[0] if distance else None, fov=fov, aspect=aspect)


def _colour(values: Colour) -> tuple[float, float, float]:
    """Check that a colour has three values. Raises UserError."""
    if len(values) != 3:
        raise UserError(f"background: {len(values)} numbers; red, green and blue are needed")
    red, green, blue = values
    return red, green, blue


def _two_levels(options: RenderOptions, levels: int) -> RenderOptions:
    """Choose levels 1 and the last one for the halves of a split, where none is asked for. Raises UserError."""
    if options.level is None and options.normal_level is None:
        options = replace(options, level=1, normal_level=levels)
    level, normal_level = options.resolved_levels(levels)
    if level == normal_level:
        raise UserError(f"--split: both halves would have the normals of level {level}; choose another --level")
    return options
