"""The window of `mplicits view`, from opening to closing."""

from pathlib import Path

from ...model.errors import UserError
from ..draw.camera import Camera
from ..draw.context import NoDisplayError
from ..draw.options import RenderOptions
from ..state.overlay import MeshFile
from ..state.view import keys
from .window import Window


def show_window(
    path: Path,
    camera: Camera,
    options: RenderOptions,
    size: tuple[int, int],
    storage: str,
    watch: bool = False,
    mesh: tuple[Path, str] | None = None,
) -> None:
    """Opens the window and returns when it is closed. Raises UserError where there is no display."""
    try:
        window = Window(
            path, camera, options, size, storage=storage, watch=watch, mesh=None if mesh is None else MeshFile(*mesh)
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
