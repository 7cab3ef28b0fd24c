"""A trained model as programs use it: `Field`, a function of points that also draws, meshes, bakes and shows itself."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Union, overload

import numpy as np
from numpy.typing import NDArray

from .codegen.printers.field import PLAIN
from .codegen.reference.evaluate import Evaluator
from .codegen.reference.hits import Hits
from .codegen.targets.orbit import FOV
from .codegen.targets.registry import DEFAULT
from .codegen.targets.uniforms import SCHEDULES
from .mesher.eval_cli import DEFAULT_RESOLUTION
from .model.errors import UserError
from .model.model import MODEL_SPACE, Model, level_networks, shape_of, sizes
from .model.model import save as save_model
from .model.orientation import as_in_file, upright

if TYPE_CHECKING:
    from .mesher.evaluation import Evaluation
    from .mesher.made import TriangleMesh
    from .trainer.networks.differentiable import Tensor, TorchField
    from .viewer.still import Colour

Array = NDArray[np.float32]
Nested = Sequence[Union[float, "Nested"]]
Points = NDArray[np.floating] | NDArray[np.integer] | Nested
"""Points (..., 3): arrays of any shape that ends in 3, or lists of them."""

SPACES = ("model", "input")
"""Of points, rays and what comes out: where the shape fits the unit sphere, or where the shape's file has it."""


class Field:
    """A trained multiscale neural signed distance function (Section 3), ready to be asked.

    `mplicits.load` and `mplicits.train` give one. Calling it is `sdf`. Any number of threads may use it at once.
    Points are in model space, where the shape fits the unit sphere, y is up, and distances count in its radius; with
    `space="input"` they are in the coordinates of the shape's file, and so is what comes out. `level` is the last level
    that is used; None uses all. `time` is the fourth input of a model that moves. Tensors of PyTorch give tensors, on
    their device, differentiable in the points. What does not fit raises `UserError`, whose text is one line.
    """

    def __init__(self, model: Model) -> None:
        """model: as `mplicits.model.model.load` reads it."""
        self.model = model
        self._evaluator = Evaluator(model)

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
        from .codegen.ir.lower import lower
        from .codegen.reference.cells import Cells

        cells = Cells(lower(self.model), 64)
        occupied = np.argwhere((cells.grid() == 0) & (cells.moments == 1))[:, ::-1]
        if not len(occupied):
            return np.array([[-1.0] * 3, [1.0] * 3])
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

    @overload
    def __call__(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def __call__(
        self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> Array: ...

    def __call__(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the signed distance; see `sdf`."""
        return self.sdf(points, level, space=space, time=time)

    @overload
    def sdf(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def sdf(self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0) -> Array: ...

    def sdf(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the signed distance at points (..., 3): (...) float32, negative inside.

        It is the finest level's that is defined at a point (Eq. 3), up to `level`. Finer levels are evaluated only
        where their band is, in chunks, on all cores.
        """
        factor = self._scale(space)
        if (tensor := self._tensor(points)) is not None:
            placed = self._placed_tensor(tensor, space)
            return self._torch.value(placed, level, time).reshape(tensor.shape[:-1]) * factor
        rows, shape = self._rows(points, space)
        value = self._evaluator.value(rows, level, time).reshape(shape)
        return value if factor == 1 else value * np.float32(factor)

    @overload
    def gradient(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def gradient(
        self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> Array: ...

    def gradient(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the gradient of `sdf` at points (..., 3): (..., 3) float32, nearly of length 1.

        On the surface it is the outward normal. It comes from the networks' own adjoint pass, not from differences.
        """
        self._scale(space)
        if (tensor := self._tensor(points)) is not None:
            placed = self._torch.gradient(self._placed_tensor(tensor, space), level, time)
            if space == "input" and self.model.up != MODEL_SPACE[2]:
                placed = placed @ placed.new_tensor(upright(np.eye(3), self.model.up).T)
            return placed.reshape(tensor.shape)
        rows, shape = self._rows(points, space)
        gradient = self._evaluator.gradient(rows, level, time)
        if space == "input":
            gradient = as_in_file(gradient.astype(np.float64), self.model.up).astype(np.float32)
        return gradient.reshape(*shape, 3)

    @overload
    def color(self, points: "Tensor", *, space: str = "model", time: float = 0.0) -> "Tensor": ...

    @overload
    def color(self, points: Points, *, space: str = "model", time: float = 0.0) -> Array: ...

    def color(self, points: "Points | Tensor", *, space: str = "model", time: float = 0.0) -> "Array | Tensor":
        """Evaluate the colour at points (..., 3), which is meant for the surface: (..., 3) float32, sRGB in [0, 1].

        A model without a texture has the one colour that all pictures paint it in.
        """
        self._scale(space)
        plain = [float(channel) for channel in PLAIN.split(",")]
        if (tensor := self._tensor(points)) is not None:
            colours = self._torch.colour(self._placed_tensor(tensor, space), time)
            if colours is None:
                return tensor.new_tensor(plain).expand(tensor.shape)
            return colours.reshape(tensor.shape)
        rows, shape = self._rows(points, space)
        values = self._evaluator.colour(rows, time)
        values = np.tile(np.array(plain, np.float32), (len(rows), 1)) if values is None else values
        return values.reshape(*shape, 3)

    def trace(
        self,
        origins: Points,
        directions: Points,
        level: int | None = None,
        *,
        space: str = "model",
        time: float = 0.0,
    ) -> Hits:
        """Find where rays meet the surface first.

        origins, directions: (..., 3), which are broadcast; directions of any length but 0. A ray that begins inside
        the shape meets it at its origin. The surface is looked for in the unit ball and a little beyond.
        """
        from .codegen.reference.trace import trace

        scale = self._scale(space)
        level = self._evaluator.checked(level)
        starts, along = np.broadcast_arrays(_numbers(origins), _numbers(directions))
        shape = starts.shape[:-1]
        starts, along = starts.reshape(-1, 3), along.reshape(-1, 3)
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise UserError("directions: one is of length 0, or not a number")
        along = along / lengths
        placed, turned = starts, along
        if space == "input":
            placed = (upright(starts, self.model.up) - self.model.centre) / scale
            turned = upright(along, self.model.up)
        t = trace(self.model, self._evaluator, placed, turned, level, time)
        hit = np.isfinite(t)
        met, normals = np.full(starts.shape, np.nan), np.full(starts.shape, np.nan, np.float32)
        at = placed[hit] + t[hit, None] * turned[hit]
        gradient = self._evaluator.gradient(at.astype(np.float32), level, time).astype(np.float64)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
        normals[hit] = as_in_file(gradient, self.model.up) if space == "input" else gradient
        met[hit] = starts[hit] + scale * t[hit, None] * along[hit]
        return Hits(hit.reshape(shape), (t * scale).reshape(shape), met.reshape(*shape, 3), normals.reshape(*shape, 3))

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
        from .viewer.arguments import colours
        from .viewer.draw.screenshot import to_bytes
        from .viewer.still import Asked, draw_still

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
        from .mesher.made import make_mesh

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
    ) -> str:
        """Write the model as shader source, a web page, or a function for another program, and return the text.

        path: a file to write it to as well. The other arguments are the options of `mplicits bake`, with their names
        and defaults; docs/targets.md lists the targets.
        """
        from .codegen.baked import bake
        from .model.files import check_writable, write_whole
        from .model.kinds import GENERATED

        if path is not None:
            check_writable(Path(path), kind=GENERATED)
        text = bake(self.model, target, storage, digits, precision, name, space).text
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
        from .mesher.evaluation import evaluate

        return evaluate(self.model, Path(shape), resolution, level, samples, seed, quiet, time)

    def info(self) -> dict[str, object]:
        """Return what `mplicits info --json` prints: levels, costs, quality figures, bytes as each target."""
        from .codegen.facts import model_facts

        return model_facts(self.model)

    def save(self, path: str | Path) -> None:
        """Write the model file (docs/format.md), whole or not at all."""
        from .model.files import check_writable
        from .model.kinds import MODEL

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

    @cached_property
    def _torch(self) -> "TorchField":
        if self.model.scene is not None:
            raise UserError("a scene takes arrays; tensors of PyTorch are for its shapes' own models")
        if self.model.scene is not None:
            raise UserError("a scene takes arrays; tensors of PyTorch are for models of one shape")
        from .trainer.networks.differentiable import TorchField

        return TorchField(self.model)

    def _tensor(self, points: "Points | Tensor") -> "Tensor | None":
        """Return points that are a tensor of PyTorch; None for all others. PyTorch is not loaded to find out."""
        if not type(points).__module__.startswith("torch"):
            return None
        from .trainer.networks.differentiable import Tensor

        return points if isinstance(points, Tensor) else None

    def _placed_tensor(self, points: "Tensor", space: str) -> "Tensor":
        """Bring a tensor of points (..., 3) into model space: (N, 3) float32. Raises UserError."""
        _check_last_axis(tuple(points.shape))
        rows = points.reshape(-1, 3)
        if space == "input":
            rows = rows.double() @ rows.new_tensor(upright(np.eye(3), self.model.up)).double()
            rows = (rows - rows.new_tensor(self.model.centre)) / self.model.scale
        return rows.float()

    def _rows(self, points: "Points | Tensor", space: str) -> tuple[Array, tuple[int, ...]]:
        """Bring points (..., 3) into model space: (N, 3) float32, and the shape (...). Raises UserError."""
        rows = _numbers(points)
        shape = rows.shape[:-1]
        rows = rows.reshape(-1, 3)
        if space == "input":
            rows = (upright(rows, self.model.up) - self.model.centre) / self.model.scale
        return rows.astype(np.float32), shape

    def _scale(self, space: str) -> float:
        """Return the length of model space's unit in a space. Raises UserError where there is no such space."""
        if space not in SPACES:
            raise UserError(f"space {space!r} is none of {', '.join(SPACES)}")
        return self.model.scale if space == "input" else 1.0


def _numbers(points: object) -> NDArray[np.float64]:
    """Return points (..., 3) as doubles. Raises UserError where they are none."""
    try:
        numbers = np.asarray(points, np.float64)
    except (TypeError, ValueError):
        raise UserError("points: numbers of shape (..., 3) are needed") from None
    _check_last_axis(numbers.shape)
    return numbers


def _check_last_axis(shape: tuple[int, ...]) -> None:
    if not shape or shape[-1] != 3:
        raise UserError(f"points of shape {shape}: the last axis must be x, y, z")
