"""A GLSL target's result: text, weight texture, and the facts that a renderer needs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...field.cells import LOOKUPS, Cells
from ...field.half_widths import Grid
from ...field.openness import BLOCK, EVALUATIONS
from ...ir.program import Array

LOOP_LIMIT = 65_535
"""Loop iterations after which Mesa's llvmpipe silently stops a fragment (LP_MAX_TGSI_LOOP_ITERATIONS)."""
LEAST_STEPS = 3
"""Fewest sphere tracing steps per round of the last level where LOOP_LIMIT forbids more."""

NumberedText = tuple[str, tuple[str, ...]]
"""A shader's text, and the files of glsl/ that its `#line` directives number (glsl.load_numbered)."""
FRAME = {
    "near": "mask_near",
    "newton": "gradient",
    "untraced": "mask_unfinished",
    "trace": "trace",
    "hits": "mask_unfinished",
    "normals": "gradient",
    "floor": "floor",
    "background": "draw_background",
    "color": "color",
}
"""The steps of a frame, in order, and the pass that each draws (a file of glsl/passes/).

The viewer and the page draw them. "newton" and "untraced" are for rays that take Newton's step before they are traced
(Shader.newton_first), "floor" for the shading softbox. The page has other masks (glsl/passes/blocks.vert.glsl).
"""

MASKED = ("gradient", "trace", "color")
"""The passes that evaluate the field: they draw only where the depth that an earlier step has written lets them.

Drivers test the depth before a fragment shader begins, so software drivers, which mask branches and do not skip them,
draw a frame several times as fast.
"""

NEWTON_STEPS = 2
"""Most of Newton's steps of a ray before it is traced, where the CPU draws (viewer/draw/packing.py)."""

FLOOR_BLOCK = BLOCK
"""Side of the blocks, in pixels, at whose corners the pass "floor" evaluates the light."""

LISTS = {"value_loops": int, "gradient_loops": int, "iterations": int, "deltas": float}
"""Facts of a shader that are lists with a number for each level, and their types."""


@dataclass(frozen=True, eq=False)
class Shader:
    """A complete fragment shader."""

    text: str
    """GLSL with header line and uniforms, without a weight texture."""
    weights: Array | None
    """(H, W, 4) float32, for the sampler `weights`; None where all weights are literals."""
    value_loops: tuple[int, ...]
    """Loop iterations of one field(p, level), at index level - 1."""
    gradient_loops: tuple[int, ...]
    """Loop iterations of one field_gradient(p, level), at index level - 1."""
    texture_loops: int
    """Loop iterations of the color."""
    iterations: tuple[int, ...]
    """Default of the uniform `iterations`: sphere tracing steps at each level, per round."""
    deltas: tuple[float, ...]
    """Default of the uniform `delta`: band half-width of each level, model units."""
    textured: bool = False
    """Whether the model has colors."""
    moving: bool = False
    """Whether the field moves, and the shader has the uniform `time`."""
    ground: float = -1.0
    """Default of the uniform `ground`: height of the shape's lowest point, model space."""
    passes: Mapping[str, NumberedText] | None = None
    """The text of each pass of FRAME, for a renderer with depth buffers. "softbox" replaces "color" for the
    shading softbox."""
    cells: Cells | None = None
    """The grids for the sampler `cells` of skip.glsl, for passes; None where rays skip nothing."""
    few_cells: Cells | None = None
    """The grid in the text of a shader in one file; None where it has none."""
    narrow: tuple[Grid, ...] = ()
    """The band widths in the text, a grid for each level before the last; empty where it has none."""
    newton_first: bool = False
    """Whether rays may take Newton's step before they are traced: a gradient there takes at most twice the time of a
    value."""
    files: tuple[str, ...] = ()
    """Files of glsl/ that `#line` directives in the text number (glsl.load_numbered)."""

    @property
    def levels(self) -> int:
        return len(self.value_loops)

    def facts(self) -> dict[str, Any]:
        """Return the facts for the header line, from which `of_facts` restores the shader."""
        lists = {key: list(getattr(self, key)) for key in LISTS}
        further = {"ground": self.ground} | ({"moving": True} if self.moving else {})
        return {**lists, "texture_loops": self.texture_loops, "textured": self.textured, **further}

    @classmethod
    def of_facts(cls, facts: Mapping[str, Any], text: str, weights: Array | None) -> "Shader":
        """Restore a shader from its text and the facts in its header line.

        Raises ValueError where a fact is missing or wrong.
        """
        lists: dict[str, Any] = {
            key: tuple(_number(value, kind) for value in _list(facts.get(key))) for key, kind in LISTS.items()
        }
        if len({len(values) for values in lists.values()}) != 1 or not lists["deltas"]:
            raise ValueError("the lists are not of one length")
        return cls(
            text=text,
            weights=weights,
            texture_loops=_number(facts.get("texture_loops"), int),
            textured=facts.get("textured") is True,
            moving=facts.get("moving") is True,
            ground=_height(facts.get("ground")),
            **lists,
        )

    def worst_loops(self, level: int, normal_level: int, iterations: Sequence[int], rounds: int, schedule: str) -> int:
        """Return an upper bound of the loop iterations of one fragment; llvmpipe allows LOOP_LIMIT.

        level: the traced level. normal_level: the level whose gradient is the normal. Both count from 1. iterations:
        steps at each level, per round. In the schedule "relaxed", a round has only the last level's steps, and a ray
        reads the grid of cells LOOKUPS times.
        """
        phases, skips = list(zip(iterations[:level], self.value_loops[:level], strict=True)), 0
        if schedule == "relaxed":
            phases = [(steps, loops + 1) for steps, loops in phases[-1:]]
            skips = LOOKUPS
        one_round = sum(1 + steps * (1 + loops) + 1 for steps, loops in phases) + 2
        softbox = EVALUATIONS * (1 + self.value_loops[0]) + 1
        return rounds * one_round + skips + softbox + 1 + self.gradient_loops[normal_level - 1] + self.texture_loops


def _list(value: object) -> list[object]:
    if not isinstance(value, list):
        raise ValueError("not a list")
    return value


def _height(value: object) -> float:
    """Return a height. Raises ValueError where it is not in the unit ball."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not -2 < value < 2:
        raise ValueError("not a height in the unit ball")
    return float(value)


def _number(value: object, kind: type) -> Any:
    """Return a number of at least 0 as int or float. Raises ValueError for other values."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < float("inf"):
        raise ValueError("not a number that counts or measures")
    if kind(value) != value:
        raise ValueError("not a whole number")
    return kind(value)
