"""The model on the screen, with what draws it and the view of it."""

from pathlib import Path

from ...model.errors import UserError
from ..draw.context import Context
from ..draw.renderer import Renderer
from .jobs import LevelTiming
from .overlay import MESH_MODES, MeshSource, Overlay
from .source import Source, open_source
from .view import View


class Shown:
    """A model or shader and its renderer, perhaps with a mesh over it, and how the user looks at it."""

    def __init__(self, context: Context, source: Source, view: View, storage: str, mesh: MeshSource | None) -> None:
        """Compile the shader of `source`.

        storage: how shaders hold the weights, also those of models that are loaded later. mesh: laid over the model.
        Raises UserError if the driver refuses the shader, or its loop limit what `view` asks for.
        """
        self.context, self.source, self.view, self._storage = context, source, view, storage
        self.renderer = Renderer(context, source.shader, view.options.shade)
        self.renderer.schedule(view.options)
        self.overlay = None if mesh is None else Overlay(context, mesh, storage)
        self.level_timings = list[LevelTiming]()
        """What each level costs, as far as it was measured for this model."""

    @property
    def mesh_mode_changed(self) -> bool:
        """Whether the view asks for another mode of the mesh than `drawn_by` was last called for."""
        return self.overlay is not None and self.overlay.mode != self.view.mesh

    def drawn_by(self) -> Renderer:
        """Return what draws the picture: `renderer`, or in its place a rasterizer of the mesh.

        Raises UserError if the mesh cannot be shown; the view then hides it.
        """
        if self.overlay is None:
            return self.renderer
        try:
            return self.overlay.over(self.renderer, self.source, self.view.mesh)
        except UserError:
            self.view.mesh = MESH_MODES[0]
            raise

    def compiled(self, path: Path) -> tuple[Source, Renderer]:
        """Read a model or shader file and compile its shader; what is shown stays as it is.

        Raises UserError if the file cannot be read, or the driver refuses its shader or what the view asks for.
        """
        source = open_source(path, self._storage)
        renderer = Renderer(self.context, source.shader, self.view.options.shade)
        try:
            renderer.schedule(self.view.fitting(source.shader.levels, source.textured))
        except UserError:
            renderer.release()
            raise
        return source, renderer

    def adopt(self, source: Source, renderer: Renderer) -> None:
        """Show what `compiled` gave in place of what was shown."""
        another = source.path != self.source.path
        self.renderer.release()
        self.renderer, self.source, self.level_timings = renderer, source, []
        self.view.adopt(source.shader.levels, source.textured, source.shader.moving)
        if another and source.front is not None:
            self.view.look_from(source.front)

    def lay_over(self, mesh: MeshSource | None) -> None:
        """Put a mesh, hidden at first, or none, in the place of the mesh that was laid over the model."""
        if self.overlay is not None:
            self.overlay.release()
        self.overlay = None if mesh is None else Overlay(self.context, mesh, self._storage)
        self.renderer.edges, self.view.mesh = None, MESH_MODES[0]

    def release(self) -> None:
        if self.overlay is not None:
            self.overlay.release()
        self.renderer.release()
