"""A mesh over the picture of its model, or in its place."""

from dataclasses import dataclass
from pathlib import Path

from ...model.errors import UserError
from ..draw.context import Context
from ..draw.edges import Edges
from ..draw.rasterizer import Rasterizer
from ..draw.renderer import Renderer
from ..draw.triangles import Triangles, read_triangles_for
from .source import Source

MESH_MODES = ("hidden", "edges", "faces", "faces and edges")
"""How to show a mesh; the first is the default."""


@dataclass(frozen=True)
class MeshSource:
    """A mesh file and its space."""

    path: Path
    """PLY, OBJ, STL or GLB."""
    space: str = "input"
    """"input", as the shape that the model was trained on, or "model"."""
    follow: bool = False
    """Whether the file may name files outside of its folder."""


class Overlay:
    """A mesh, with its edges and its rasterizer once they are needed."""

    def __init__(self, context: Context, mesh: MeshSource, storage: str) -> None:
        """storage: of the weights in the rasterizer's shader."""
        self.mode = MESH_MODES[0]
        """The mode of the last call of `renderer_for`."""
        self._context, self._mesh_source, self._storage = context, mesh, storage
        self._source: Source | None = None
        self._mesh: Triangles | None = None
        self._edges: Edges | None = None
        self._rasterizer: Rasterizer | None = None

    def renderer_for(self, renderer: Renderer, source: Source, mode: str) -> Renderer:
        """Return what draws the picture: `renderer`, which draws `source`, or a rasterizer, with edges for some modes.

        Raises UserError if the mesh is not readable, does not fit the source, or its shader does not compile.
        """
        self.mode = mode
        renderer.edges = None
        if mode == "hidden":
            return renderer
        if source.model is None:
            raise UserError("a mesh needs its model, and this file is a shader; open the model file")
        if source is not self._source or self._mesh is None:
            self.release()
            mesh = self._mesh_source
            self._mesh = read_triangles_for(source.model, mesh.path, mesh.space, follow=mesh.follow)
            self._source = source
        if "faces" in mode:
            self._rasterizer = self._rasterizer or Rasterizer(self._context, source.model, self._mesh, self._storage)
            renderer = self._rasterizer
        if "edges" in mode:
            self._edges = self._edges or Edges(self._context, self._mesh)
        renderer.edges = self._edges if "edges" in mode else None
        return renderer

    def release(self) -> None:
        """Free everything in the context; `renderer_for` makes it again."""
        for resource in (self._edges, self._rasterizer):
            if resource is not None:
                resource.release()
        self._source = self._mesh = self._edges = self._rasterizer = None
