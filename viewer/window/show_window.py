"""The window of `mplicits view`, from its opening to its closing."""

from pathlib import Path

from ...model.errors import UserError
from ..draw.camera import Camera
from ..draw.context import NoDisplayError
from ..draw.options import RenderOptions
from ..state.overlay import MeshSource
from ..state.source import Source
from ..state.view import keys
from .window import Window


def show_window(
    source: Source,
    camera: Camera,
    options: RenderOptions,
    size: tuple[int, int],
    storage: str,
    watch: bool = False,
    mesh: tuple[Path, str] | None = None,
) -> None:
    """Open a window that shows a model or shader file, and return when the user closes it.

    source: the file. camera, options: how it is shown at first.
    size: (width, height) of the window, as the system counts it.
    storage: how shaders hold the weights. watch: load the file again when it changes.
    mesh: file laid over the model, and the space of its coordinates, "input" or "model".
    Raises UserError if there is no display, if a file cannot be read, or if its shader cannot be drawn here.
    """
    try:
        window = Window(
            source,
            camera,
            options,
            size,
            storage=storage,
            watch=watch,
            mesh=None if mesh is None else MeshSource(*mesh),
        )
    except NoDisplayError as error:
        raise UserError(
            f"{error}; without one, `mplicits render` draws a picture and `mplicits bake --target html` "
            "writes a web page"
        ) from None
    if window.gui is None:
        print(f"{keys()}\na panel with every setting: pip install 'mplicits[view]'", flush=True)
    try:
        window.loop()
    finally:
        window.close()
