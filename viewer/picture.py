"""One picture of a model, drawn off screen: the work of `render`, without its files and messages."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..codegen.targets.glsl330 import bake
from ..model.files import show
from ..model.model import Model
from .draw.camera import Camera
from .draw.compile import compile_quickly, compiling_dominates, storage_for
from .draw.context import Context, check_process, open_context
from .draw.current import kept_current
from .draw.rasterizer import Rasterizer
from .draw.renderer import Renderer
from .draw.supersampling import Image
from .draw.triangles import read_triangles_for
from .options import PictureOptions

_DRAWING = threading.Lock()
"""One picture at a time: not all drivers take several threads at once."""


@dataclass(frozen=True, eq=False)
class Setup:
    """All that a picture of a model needs, in an open context."""

    renderer: Renderer
    """With its shader compiled."""
    camera: Camera
    options: PictureOptions


@contextmanager
def set_up(model: Model, options: PictureOptions, rays: int, once: bool = False) -> Iterator[Setup]:
    """Open an OpenGL context, compile the shader of a model, and close both afterwards.

    rays: of all pictures that follow. once: whether the process draws nothing else, so that a few rays do without an
    optimized program (`compile_quickly`). Raises UserError where the options do not fit the model, or where OpenGL
    fails. One thread at a time is inside.
    """
    options.check_time(show(model.name), model.inputs == "xyzt")
    options.check_texture(model.colored)
    camera = options.view_from(model.front)
    options = options.for_levels(len(model.levels))
    options.resolved_levels(len(model.levels))
    mesh = None
    if options.mesh is not None:
        mesh = read_triangles_for(model, Path(options.mesh), options.space or "input", follow=options.follow)
    if once and compiling_dominates(rays, model.parameters()):
        compile_quickly()
    check_process()
    with _DRAWING, kept_current():
        context = open_context(options.context)
        try:
            storage = storage_for(options.storage, rays, model.parameters(), context.software)
            with _compile_notice(context):
                if mesh is None:
                    renderer = Renderer(context, bake(model, storage, passes=True), options.shade)
                else:
                    renderer = Rasterizer(context, model, mesh, storage)
            renderer.schedule(options)
            yield Setup(renderer, camera, options)
            renderer.release()
        finally:
            context.release()


def draw_picture(model: Model, options: PictureOptions) -> Image:
    """Draw a picture of a model: (H, W, 4) float32, sRGB and coverage, top row first. Raises UserError as `set_up`."""
    with set_up(model, options, options.rays()) as setup:
        return setup.renderer.render(options.pixels, setup.camera, setup.options)


@contextmanager
def _compile_notice(context: Context) -> Iterator[None]:
    """Say on a terminal, for the while, that a shader is compiled."""
    terminal = sys.stderr is not None and sys.stderr.isatty()
    if terminal:
        print(f"compiling the shader on {context.renderer}", end="\r", file=sys.stderr, flush=True)
    try:
        yield
    finally:
        if terminal:
            print("\x1b[K", end="", file=sys.stderr, flush=True)
