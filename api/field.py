"""`Field`: a trained model as a Python object, which evaluates, draws, meshes, bakes and displays itself."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..bake.options import BakeOptions, InfoOptions, PackOptions
from ..mesher.options import EvalOptions, MeshOptions
from ..model.files import path_of
from ..model.model import level_networks, size_text, sizes
from ..model.model_file import save as save_model
from ..model.options import takes
from ..viewer.options import PictureOptions
from .field_function import FieldFunction

if TYPE_CHECKING:
    from ..mesher.evaluation import Evaluation
    from ..mesher.triangle_mesh import TriangleMesh


class Field(FieldFunction):
    """A trained multiscale neural signed distance function (Section 3).

    `mplicits.load` and `mplicits.train` return one; calling it evaluates `sdf`. Several threads may share it.
    Points and results are in model space: the shape fits the unit sphere, y is up, and the unit is the sphere's radius.
    With `space="input"` they are in the coordinates of the shape's file. `level`: last level to use; None: all.
    `time`: fourth input of a model that moves. PyTorch tensors give tensors on the same device, differentiable in the
    points. Wrong arguments raise `UserError`, whose text is one line.
    """

    @property
    def name(self) -> str:
        """The model's name, usually the name of the shape's file."""
        return self.model.name

    @property
    def levels(self) -> tuple[str, ...]:
        """Size of each level's network, coarse to fine, as `train` takes them: ("64x1", "64x2")."""
        return tuple(sizes(level_networks(self.model, i)) for i in range(len(self.model.levels)))

    @property
    def parameters(self) -> int:
        """Number of weights and biases, including the texture's."""
        return self.model.parameters()

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """A tight box around the surface, model space: (2, 3), the smallest and the largest corner.

        For a model that moves, the cube from -1 to 1, which holds the shape at all times.
        """
        cube = np.array([[-1.0] * 3, [1.0] * 3])
        if self.model.inputs == "xyzt":
            return cube
        from ..field.cell_codes import EMPTY
        from ..field.cells import Cells
        from ..ir.lower import lower

        cells = Cells(lower(self.model), 64)
        occupied = np.argwhere(cells.grid() >= EMPTY)[:, ::-1]
        if not len(occupied):
            return cube
        edge = 2 * cells.half / cells.count
        return np.stack((occupied.min(axis=0), occupied.max(axis=0) + 1)) * edge - cells.half

    def __repr__(self) -> str:
        """Describe the model in a line."""
        texture = "" if self.model.texture is None else f", colors by {size_text(self.model.texture)}"
        texture = f", a scene of {len(self.model.shapes)} models" if self.model.scene is not None else texture
        moves = ", moving" if self.model.inputs == "xyzt" else ""
        return (
            f"<mplicits.Field {self.name!r}: {' > '.join(self.levels)}{texture}{moves}, {self.parameters:,} parameters>"
        )

    @takes(PictureOptions)
    def render(self, options: PictureOptions) -> NDArray[np.uint8]:
        """Draw a picture without a display: (H, W, 3) uint8, top row first; with transparent=True (H, W, 4).

        size: N, (width, height) or "640x480". camera: (azimuth, elevation) in degrees, or with a distance in radii of
        the shape. background: "#rrggbb", "#rrggbb,#rrggbb" for top and bottom, or two colors in [0, 1]. More in
        docs/viewer.md. Raises UserError.
        """
        from ..viewer.draw.screenshot import to_bytes
        from ..viewer.picture import draw_picture

        image = draw_picture(self.model, options)
        return to_bytes(image if options.transparent else image[..., :3], dithered=not options.transparent)

    @takes(MeshOptions)
    def mesh(self, options: MeshOptions) -> "TriangleMesh":
        """Extract the surface as triangles, by marching cubes (docs/meshing.md). Raises UserError."""
        from ..mesher.triangle_mesh import make_mesh

        return make_mesh(self.model, options)

    @takes(BakeOptions)
    def bake(self, options: BakeOptions) -> str:
        """Return the model as shader source, a web page, or a function for another program; docs/targets.md.

        Raises UserError.
        """
        from ..bake.bake import bake
        from ..bake.registry import TARGETS
        from ..model.files import check_writable, write_whole
        from ..model.kinds import GENERATED

        path = None if options.path is None else Path(options.path)
        files = {} if path is None else {path: ""} | TARGETS[options.target].beside(path)
        for file in files:
            check_writable(file, kind=GENERATED)
        text = bake(self.model, options)[0].text
        for file, more in files.items():
            write_whole(file, more or text)
        return text

    @takes(EvalOptions)
    def evaluate(self, shape: str | Path, options: EvalOptions) -> "Evaluation":
        """Compare the model with its ground truth, a mesh in a file; see `mplicits.evaluate`."""
        from ..mesher.evaluation import evaluate

        return evaluate(self.model, path_of(shape, "shape"), options)

    @takes(PackOptions)
    def pack(self, options: PackOptions) -> "Field":
        """Round the weights to few bits, and return the model: `save` writes a file of a fifth of the bytes."""
        from ..field.pack import packed
        from ..model.bits import read_bits

        return Field(packed(self.model, read_bits(options.bits)).model)

    @takes(InfoOptions)
    def info(self, options: InfoOptions) -> dict[str, object]:
        """Return the facts of `mplicits info --json`: levels, costs, quality; bytes of each target on request."""
        from ..bake.facts import model_facts

        return model_facts(self.model, sizes=options.sizes)

    def save(self, path: str | Path) -> None:
        """Write the model file (docs/format.md), whole or not at all."""
        from ..model.files import check_writable
        from ..model.kinds import MODEL

        file = path_of(path, "path")
        check_writable(file, kind=MODEL)
        save_model(self.model, file)

    def show(self) -> None:
        """Display the model: live in a notebook, else as a page in the web browser."""
        from .notebook import show

        show(self)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        """Return a notebook's display of the model: a picture, and the live page."""
        return self._display

    @cached_property
    def _display(self) -> dict[str, str]:
        from .notebook import mimebundle

        return mimebundle(self)
