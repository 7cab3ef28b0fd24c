"""A mesh over the picture of its model, or in its place: its edges; its faces, which wear the model's normals."""

from dataclasses import dataclass
from pathlib import Path

from ...model.errors import UserError
from ..draw.context import Context
from ..draw.edges import Edges
from ..draw.rasteriser import Rasteriser
from ..draw.renderer import Renderer
from ..draw.triangles import Triangles, read_mesh_of
from .source import Source

SHOWN = ("hidden", "edges", "faces", "faces and edges")


@dataclass(frozen=True)
class MeshFile:
    """space: of its coordinates, "input" (of the shape that a model was trained on) or "model"."""

    path: Path
    space: str = "input"


class Overlay:
    """What is compiled for a mesh and a model, as soon as it is shown."""

    def __init__(self, context: Context, mesh: MeshFile, storage: str) -> None:
        self._context, self._file, self._storage = context, mesh, storage
        self._source: Source | None = None
        self._mesh: Triangles | None = None
        self._edges: Edges | None = None
        self._rasteriser: Rasteriser | None = None

    def over(self, renderer: Renderer, source: Source, shown: str) -> Renderer:
        """What draws the picture: `renderer`, of `source`, or a rasteriser in its place; shown: one of SHOWN.

        Raises UserError where the mesh cannot be read, or does not belong to the source.
        """
        renderer.edges = None
        if shown == "hidden":
            return renderer
        if source is not self._source or self._mesh is None:
            self.release()
            if source.model is None:
                raise UserError("a mesh needs the model that it belongs to, not its shader alone; open the model file")
            self._source, self._mesh = source, read_mesh_of(source.model, self._file.path, self._file.space)
        drawn = renderer
        if "faces" in shown:
            assert source.model is not None
            self._rasteriser = self._rasteriser or Rasteriser(self._context, source.model, self._mesh, self._storage)
            drawn = self._rasteriser
        if "edges" in shown:
            self._edges = self._edges or Edges(self._context, self._mesh)
        drawn.edges = self._edges if "edges" in shown else None
        return drawn

    def release(self) -> None:
        """Frees what is held in the context."""
        for held in (self._edges, self._rasteriser):
            if held is not None:
                held.release()
        self._source = self._mesh = self._edges = self._rasteriser = None
