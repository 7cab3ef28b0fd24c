"""A trained model as programs use it: `Field`, a function of points that also draws, meshes, bakes and shows itself."""

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..bake.registry import DEFAULT
from ..codegen.targets.orbit import FOV
from ..codegen.targets.uniforms import SCHEDULES
from ..mesher.eval_cli import DEFAULT_RESOLUTION
from ..model.model import level_networks, shape_of, sizes
from ..model.model_file import save as save_model
from .field_function import FieldFunction

if TYPE_CHECKING:
    from ..mesher.evaluation import Evaluation
    from ..mesher.made import TriangleMesh
    from ..viewer.still import Colour


class Field(FieldFunction):
    """A trained multiscale neural signed distance function (Section 3), ready to be asked.

    `mplicits.load` and `mplicits.train` give one. Calling it is `sdf`. Any number of threads may use it at once.
    Points are in model space, where the shape fits the unit sphere, y is up, and distances count in its radius; with
    `space="input"` they are in the coordinates of the shape's file, and so is what comes out. `level` is the last level
    that is used; None uses all. `time` is the fourth input of a model that moves. Tensors of PyTorch give tensors, on
    their device, differentiable in the points. What does not fit raises `UserError`, whose text is one line.
    """

    @property
    def name(self) -> str:
        """The model's name, usually that of the file that the shape came from."""
        return self.model.name

    @property
    def levels(self) -> tuple[str, ...]:
        """The size of each level's network, the coarsest first, as `train` takes them: ("64x1", "64x2")."""
        return tuple(sizes(level_networks(self.model, i)) for i in range(len(self.model.levels)))

    @property
    def parameters(self) -> int:
        """How many weights and biases there are, those of the texture included."""
        return self.model.parameters()

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """A box in model space that holds the surface and little more: (2, 3), its least and its largest corner.

        Where the field moves it is the cube from -1 to 1, which holds the shape at any time.
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
        texture = "" if self.model.texture is None else f", colours by {shape_of(self.model.texture)}"
        texture = f", a scene of {len(self.model.shapes)} models" if self.model.scene is not None else texture
        moves = ", moving" if self.model.inputs == "xyzt" else ""
        return (
            f"<mplicits.Field {self.name!r}: {' > '.join(self.levels)}{texture}{moves}, {self.parameters:,} parameters>"
        )

    def render(
        self,
        size: int | tuple[int, int] = 512,
        camera: tuple[float, ...] | None = None,
        fov: float = FOV,
        level: int | None = None,
        normal_level: int | None = None,
        shade: str = "phong",
        iterations: tuple[int, ...] | None = None,
        rounds: int | None = None,
        schedule: str = SCHEDULES[-1],
        delta_scale: float = 1.0,
        step_scale: float | None = None,
        plain: bool = False,
        light: tuple[float, float, float] | None = None,
        background: "str | tuple[Colour, Colour] | None" = None,
        samples: int = 16,
        uniform: bool = False,
        time: float | None = None,
        mesh: str | Path | None = None,
        space: str | None = None,
        storage: str = "auto",
        context: str = "auto",
        transparent: bool = False,
        split: bool = False,
    ) -> NDArray[np.uint8]:
        """Draw a picture without a display: (H, W, 3) uint8, top row first, or (H, W, 4) where it is transparent.

        The arguments are the options of `mplicits render`, with their names and defaults: size is N or (width,
        height); camera (azimuth, elevation) in degrees, or with a distance in radii of the shape; shade "phong",
        "studio", "normal", "texture", "depth" or "steps"; background "#rrggbb", "#rrggbb,#rrggbb" for top and bottom,
        or two colours in [0, 1]. docs/viewer.md explains the rest.
        """
        from ..viewer.arguments import colours
        from ..viewer.draw.screenshot import to_bytes
        from ..viewer.still import Asked, draw_still

        asked = Asked(
            size=(size, size) if isinstance(size, int) else size,
            camera=camera,
            fov=fov,
            level=level,
            normal_level=normal_level,
            shade=shade,
            iterations=iterations,
            rounds=rounds,
            schedule=schedule,
            delta_scale=delta_scale,
            step_scale=step_scale,
            plain=plain,
            light=light,
            background=colours(background) if isinstance(background, str) else background,
            samples=samples,
            uniform=uniform,
            time=time,
            mesh=None if mesh is None else Path(mesh),
            space=space,
            storage=storage,
            context=context,
            transparent=transparent,
            split=split,
        )
        image = draw_still(self.model, asked)
        return to_bytes(image if transparent else image[..., :3], dithered=not transparent)

    def mesh(
        self,
        resolution: int = DEFAULT_RESOLUTION,
        level: int | None = None,
        no_cull: bool = False,
        space: str = "input",
        quiet: bool = False,
        time: float | None = None,
    ) -> "TriangleMesh":
        """Extract the surface as triangles, by marching cubes: vertices, faces, normals and colors.

        The arguments are the options of `mplicits mesh`, with their names and defaults: resolution counts the cells
        along each side of the grid; space is that of the vertices; time is of a model that moves. docs/meshing.md
        explains the rest.
        """
        from ..mesher.made import make_mesh

        return make_mesh(self.model, resolution, level, no_cull, space, quiet, time)

    def bake(
        self,
        target: str = DEFAULT,
        path: str | Path | None = None,
        storage: str = "auto",
        digits: int | None = None,
        precision: str = "float32",
        name: str | None = None,
        space: str | None = None,
        shade: str | None = None,
    ) -> str:
        """Write the model as shader source, a web page, or a function for another program, and return the text.

        path: a file to write it to as well. The other arguments are the options of `mplicits bake`, with their names
        and defaults; docs/targets.md lists the targets.
        """
        from ..bake.bake import bake
        from ..model.files import check_writable, write_whole
        from ..model.kinds import GENERATED

        if path is not None:
            check_writable(Path(path), kind=GENERATED)
        text = bake(self.model, target, storage, digits, precision, name, space, shade).text
        if path is not None:
            write_whole(Path(path), text)
        return text

    def evaluate(
        self,
        shape: str | Path,
        resolution: int | None = None,
        level: int | None = None,
        samples: int = 500_000,
        seed: int = 0,
        quiet: bool = False,
        time: float | None = None,
    ) -> "Evaluation":
        """Compare the model with its ground truth, a mesh in a file; see `mplicits.evaluate`."""
        from ..mesher.evaluation import evaluate

        return evaluate(self.model, Path(shape), resolution, level, samples, seed, quiet, time)

    def info(self) -> dict[str, object]:
        """Return what `mplicits info --json` prints: levels, costs, quality figures, bytes as each target."""
        from ..bake.facts import model_facts

        return model_facts(self.model)

    def save(self, path: str | Path) -> None:
        """Write the model file (docs/format.md), whole or not at all."""
        from ..model.files import check_writable
        from ..model.kinds import MODEL

        check_writable(Path(path), kind=MODEL)
        save_model(self.model, Path(path))

    def show(self) -> None:
        """Display the model: live in a notebook, else as a page in the browser."""
        from .notebook import show

        show(self)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        """Return what a notebook shows, and keeps: a picture, and the live page."""
        return self._shown

    @cached_property
    def _shown(self) -> dict[str, str]:
        from .notebook import mimebundle

        return mimebundle(self)
