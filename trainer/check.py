"""What a training would read of a shape, without training: the work of `check`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .config import default_config
from .options import CheckOptions
from .progress import TrainingBar
from .shape_picture import SIDE, drawn
from .shapes.arrays import Arrays
from .shapes.shape import Shape
from .sources import shape_source
from .texture_detail import POINTS as DRAWN
from .texture_detail import detail_line


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
    source = shape_source(shape, options)
    loaded, warnings = source.load(TrainingBar(quiet=True), options.up or source.up)
    if loaded.moving:
        raise UserError("check: one shape at a time")
    if loaded.colored and options.texture != "none":
        largest = default_config().lengths.texture_network
        drawn = loaded.surface(DRAWN, np.random.default_rng(0), colors=True)
        if drawn.colors is not None and (finer := detail_line(drawn.points, drawn.colors, largest)):
            warnings = [*warnings, finer]
    line = f"{loaded.name}: the built-in shape" if loaded.taken is None else loaded.taken.line()
    return Checked(loaded, line, tuple(warnings))
