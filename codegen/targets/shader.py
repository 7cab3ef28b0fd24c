"""What a GLSL target makes of a model: the text, the weight texture, and the loops that llvmpipe counts."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..ir.program import Array


@dataclass(frozen=True, eq=False)
class Shader:
    """A complete fragment shader.

    weights: (H, W, 4) float32 for the sampler `weights`, or None where every weight is in the text.
    value_loops, gradient_loops: loop iterations a fragment spends on one field(p, level) and
    field_gradient(p, level), at index level - 1.
    texture_loops: the same for the colour.
    iterations, deltas: the defaults of the uniforms, one per level.
    files: names of those in glsl/ that `#line` directives in the text tell apart (glsl.load_numbered).
    """

    text: str
    weights: Array | None
    value_loops: tuple[int, ...]
    gradient_loops: tuple[int, ...]
    texture_loops: int
    iterations: tuple[int, ...]
    deltas: tuple[float, ...]
    files: tuple[str, ...] = ()

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.value_loops)

    def worst_loops(self, level: int, normal_level: int, iterations: Sequence[int], rounds: int) -> int:
        """Upper bound of the loop iterations of one fragment; llvmpipe stops silently at 65,535."""
        phases = zip(iterations[:level], self.value_loops[:level], strict=True)
        one_round = sum(1 + steps * (1 + loops) + 1 for steps, loops in phases) + 2
        return rounds * one_round + 1 + self.gradient_loops[normal_level - 1] + self.texture_loops
