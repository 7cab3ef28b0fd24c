"""What a GLSL target makes of a model: text, weight texture, and what the renderer needs to know of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...field.cells import Cells
from ...field.narrow import Grid
from ...field.skip import LOOKS
from ...field.studio import BLOCK, EVALUATIONS
from ...ir.program import Array

LOOP_LIMIT = 65_535
"""Loop iterations after which Mesa's llvmpipe stops a fragment, silently (LP_MAX_TGSI_LOOP_ITERATIONS)."""
LEAST_STEPS = 3
"""Sphere tracing steps per round of the last level, where LOOP_LIMIT forbids more."""

NumberedText = tuple[str, tuple[str, ...]]
"""A shader's text, and the names of the files in glsl/ that its `#line` directives tell apart (glsl.load_numbered)."""
PASSES = {"near": False, "normals": True, "rest": False, "trace": True, "behind": False, "colour": True}
"""The passes of a frame, and whether each evaluates the field; glsl/near.glsl, ... say what they do.

They are drawn in this order, but for "rest" and "normals", which follow on "trace" again. Each one that evaluates the
field draws only where the depth that the pass before has left lets it. Drivers see to that before a fragment shader
begins, and software ones, which mask branches and do not skip them, draw a frame several times as fast.
"""

FIRST_LOOKS = 2
"""How often "normals" looks at a ray before it is traced, at most, where the CPU draws (viewer/draw/packing.py)."""

FLOOR_BLOCK = BLOCK
"""Pixels along the side of the blocks at whose corners "floor" looks (glsl/floor.glsl)."""

LISTS = {"value_loops": int, "gradient_loops": int, "iterations": int, "deltas": float}
"""Keys of a shader's facts that are lists with a number for each level."""


@dataclass(frozen=True, eq=False)
class Shader:
    """A complete fragment shader."""

    text: str
    """GLSL, header line and uniforms included; a weight texture is not in it."""
    weights: Array | None
    """(H, W, 4) float32, for the sampler `weights`; None where every weight is in the text."""
    value_loops: tuple[int, ...]
    """Loop iterations that a fragment spends on one field(p, level), at index level - 1."""
    gradient_loops: tuple[int, ...]
    """Loop iterations that a fragment spends on one field_gradient(p, level), at index level - 1."""
    texture_loops: int
    """Loop iterations that a fragment spends on the colour."""
    iterations: tuple[int, ...]
    """Default of the uniform of this name: sphere tracing steps at each level, per round."""
    deltas: tuple[float, ...]
    """Default of the uniform `delta`: half width of each level's band, model units."""
    textured: bool = False
    """Whether the colour is the model's own, not the one of all models without a texture."""
    moving: bool = False
    """Whether the field moves, and the shader has the uniform `time`."""
    ground: float = -1.0
    """Default of the uniform of this name: height of the shape's lowest point, model space."""
    passes: Mapping[str, NumberedText] | None = None
    """The same frame in passes, for a renderer that has depth buffers: the text of each one of PASSES, by name, and
    those of "floor" and "studio", which take the place of "colour" for the shading of the latter's name: "colour" does
    not know it."""
    cells: Cells | None = None
    """The grids for the sampler `cells` of skip.glsl, which passes read; None where rays skip nothing."""
    few_cells: Cells | None = None
    """The grid that the text of a file that stands alone has; None where it has none."""
    narrow: tuple[Grid, ...] = ()
    """The widths of bands that the text has, a grid for each level before the last; none where it has none."""
    looks_first: bool = False
    """Whether the pass "normals" can give rays a first look, and is worth it: a gradient costs two values."""
    files: tuple[str, ...] = ()
    """Names of the files in glsl/ that `#line` directives in the text tell apart (glsl.load_numbered)."""

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.value_loops)

    def facts(self) -> dict[str, Any]:
        """Return what the header line keeps of this shader, so that `of_facts` can make it again from the text."""
        lists = {key: list(getattr(self, key)) for key in LISTS}
        further = {"ground": self.ground} | ({"moving": True} if self.moving else {})
        return {**lists, "texture_loops": self.texture_loops, "textured": self.textured, **further}

    @classmethod
    def of_facts(cls, facts: Mapping[str, Any], text: str, weights: Array | None) -> "Shader":
        """Make the shader of a text from the facts in its header line.

        Raises ValueError where one is missing or is no such number.
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
        """Return an upper bound of the loop iterations of one fragment; LOOP_LIMIT is what llvmpipe allows.

        level: the level that is traced; normal_level: the level whose gradient is the normal, both counted from 1.
        iterations: sphere tracing steps at each level, per round; of the schedule "relaxed", a round has those of the
        last level alone, and the grid of cells is looked at LOOKS times.
        """
        phases, skips = list(zip(iterations[:level], self.value_loops[:level], strict=True)), 0
        if schedule == "relaxed":
            phases = [(steps, loops + 1) for steps, loops in phases[-1:]]
            skips = LOOKS
        one_round = sum(1 + steps * (1 + loops) + 1 for steps, loops in phases) + 2
        studio = EVALUATIONS * (1 + self.value_loops[0]) + 1
        return rounds * one_round + skips + studio + 1 + self.gradient_loops[normal_level - 1] + self.texture_loops


def _list(value: object) -> list[object]:
    """Return a list as it is. Raises ValueError where the value is none."""
    if not isinstance(value, list):
        raise ValueError("not a list")
    return value


def _height(value: object) -> float:
    """Return a height in the unit ball. Raises ValueError where the value is none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not -2 < value < 2:
        raise ValueError("not a height in the unit ball")
    return float(value)


def _number(value: object, kind: type) -> Any:
    """Return a number of 0 or more as `kind`, int or float. Raises ValueError where it is no such number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < float("inf"):
        raise ValueError("not a number that counts or measures")
    if kind(value) != value:
        raise ValueError("not a whole number")
    return kind(value)
