"""What a training would read of a shape, without training: the work of `check`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.orientation import DEFAULT_UP, FILES_UP
from .options import CheckOptions
from .shape_picture import SIDE, drawn
from .shapes.arrays import Arrays
from .shapes.load import load_shape
from .shapes.shape import Shape
from .texture_detail import POINTS as DRAWN
from .texture_detail import detail_line

TEXTURE = (64, 2)
"""Width and depth of the largest texture network that `train` chooses by itself."""


@dataclass(frozen=True, eq=False)
class Checked:
    """A shape as a training reads it."""

    _shape: Shape
    line: str
    """What was taken: `soldier.glb: 2 meshes, 7,434 triangles, ...`."""
    warnings: tuple[str, ...]
    """What a training would warn of."""

    @property
    def facts(self) -> dict[str, Any]:
        """The line and the warnings as values for JSON."""
        taken = self._shape.taken
        return ({"line": self.line} if taken is None else taken.record()) | {"warnings": list(self.warnings)}

    def picture(self, size: int = SIDE) -> NDArray[np.uint8]:
        """Draw the shape from two sides, (size, 2 size, 3); parts that are seen from inside are red."""
        return drawn(self._shape, size)

    def __repr__(self) -> str:
        """Return the line."""
        return f"<mplicits.Checked: {self.line}>"


def check(shape: str | Path | Arrays, options: CheckOptions) -> Checked:
    """Read a shape as a training would. Raises UserError."""
    image = None if options.texture in ("auto", "none") else Path(options.texture)
    up = options.up
    if up is None:
        up = FILES_UP.get(Path(shape).suffix.lower(), DEFAULT_UP) if isinstance(shape, (str, Path)) else DEFAULT_UP
    loaded, warnings = load_shape(
        shape,
        image,
        columns=options.columns,
        follow=options.follow,
        crease=None if options.flat else options.crease,
        noise=options.noise,
        up=up,
        thicken=options.thicken,
    )
    if loaded.moving:
        raise UserError("check: one shape at a time")
    if loaded.colored and options.texture != "none":
        drawn = loaded.surface(DRAWN, np.random.default_rng(0), colors=True)
        if drawn.colors is not None and (finer := detail_line(drawn.points, drawn.colors, TEXTURE)):
            warnings = [*warnings, finer]
    line = f"{loaded.name}: the built-in shape" if loaded.taken is None else loaded.taken.line()
    return Checked(loaded, line, tuple(warnings))
