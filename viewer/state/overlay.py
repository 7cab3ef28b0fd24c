"""A mesh over the picture of its model, or in its place: its edges, and its faces with the model's normals."""

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
"""What can be shown of a mesh; the first is how it begins."""


@dataclass(frozen=True)
class MeshSource:
    """A mesh file and the space that its vertices are in."""

    path: Path
    """PLY, OBJ, STL or GLB."""
    space: str = "input"
    """"input", the space of the shape that the model was trained on, or "model"."""


class Overlay:
    """A mesh with the edges and the rasterizer that draw it; each is made when it is first needed."""

    def __init__(self, context: Context, mesh: MeshSource, storage: str) -> None:
        """storage: how the rasterizer's shader holds the weights of the model."""
        self.mode = MESH_MODES[0]
        """What `over` was last asked to show of the mesh, one of MESH_MODES."""
        self._context, self._mesh_source, self._storage = context, mesh, storage
        self._source: Source | None = None
        self._mesh: Triangles | None = None
        self._edges: Edges | None = None
        self._rasterizer: Rasterizer | None = None

    def over(self, renderer: Renderer, source: Source, mode: str) -> Renderer:
        """Return what draws the picture: `renderer`, which draws `source`, or a rasterizer in its place.

        mode: what is to be shown of the mesh, one of MESH_MODES.
        Raises UserError if the mesh cannot be read, does not belong to the source, or its shader does not compile.
        """
        self.mode = mode
        renderer.edges = None
        if mode == "hidden":
            return renderer
        if source is not self._source or self._mesh is None:
            self.release()
            if source.model is None:
                raise UserError("a mesh needs the model that it belongs to, not its shader alone; open the model file")
            mesh = read_triangles_for(source.model, self._mesh_source.path, self._mesh_source.space)
            self._source, self._mesh = source, mesh
        drawn_by = renderer
        if "faces" in mode:
            assert source.model is not None
            self._rasterizer = self._rasterizer or Rasterizer(self._context, source.model, self._mesh, self._storage)
            drawn_by = self._rasterizer
        if "edges" in mode:
            self._edges = self._edges or Edges(self._context, self._mesh)
        drawn_by.edges = self._edges if "edges" in mode else None
        return drawn_by

    def release(self) -> None:
        for held in (self._edges, self._rasterizer):
            if held is not None:
                held.release()
        self._source = self._mesh = self._edges = self._rasterizer = None
