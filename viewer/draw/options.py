"""What a picture shows besides the camera, and the bounds within which a driver draws it right."""

import math
from dataclasses import dataclass

from ...codegen.targets.shader import Shader
from ...model.errors import UserError

SHADINGS = ("phong", "normal", "depth", "steps", "texture", "data")
"""Index = value of the uniform `shading`. `data` is raw: (t, steps, level that the ray ended in, hit)."""

MAX_SAMPLES = 256
MAX_ROUNDS = 1000
MAX_ITERATIONS = 10_000
LOOP_LIMIT = 65_535
"""Loop iterations after which Mesa's llvmpipe stops a fragment, silently (LP_MAX_TGSI_LOOP_ITERATIONS)."""
LEAST_STEPS = 3
"""Steps per round of the last level, where the loop limit forbids more."""


@dataclass(frozen=True)
class RenderOptions:
    """None: the shader's default. Raises UserError where a number is out of range.

    level: last level traced. normal_level: level whose gradient shades (None: `level`); above it, normal mapping.
    iterations: steps per level and round; the last number stands for the levels that are not given.
    rounds: how often a ray may start again from level 1. delta_scale, step_scale: factors on bands and steps.
    samples: per pixel. light: direction towards it, camera space. background: sRGB (top, bottom).
    transparent: alpha is coverage, and the background is left out of rgb. plain: without the model's colours.
    split: share of the width, from the left, with the normals of `level`, or a mesh's own.
    """

    level: int | None = None
    normal_level: int | None = None
    shading: str = "phong"
    iterations: tuple[int, ...] | None = None
    rounds: int | None = None
    delta_scale: float = 1.0
    step_scale: float | None = None
    samples: int = 1
    light: tuple[float, float, float] | None = None
    background: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    transparent: bool = False
    plain: bool = False
    split: float = 0.0

    def __post_init__(self) -> None:
        if self.shading not in SHADINGS:
            raise UserError(f"shading {self.shading!r} is none of {', '.join(SHADINGS)}")
        _whole("samples", self.samples, MAX_SAMPLES)
        for steps in self.iterations or ():
            _whole("iterations", steps, MAX_ITERATIONS)
        if self.rounds is not None:
            _whole("rounds", self.rounds, MAX_ROUNDS)
        for name, factor in (("delta scale", self.delta_scale), ("step scale", self.step_scale)):
            if factor is not None and not 0.0 < factor <= 100.0:
                raise UserError(f"{name} {factor:g}: more than 0, at most 100")
        if not 0.0 <= self.split <= 1.0:
            raise UserError(f"split {self.split:g}: a share from 0 to 1")
        if self.light is not None and not (all(map(math.isfinite, self.light)) and any(self.light)):
            raise UserError("light: a direction, three finite numbers that are not all 0")

    def traced(self, levels: int) -> tuple[int, int]:
        """(level, normal level) for a model of so many levels. Raises UserError where it has no such level."""
        level = levels if self.level is None else self.level
        normal_level = level if self.normal_level is None else self.normal_level
        for name, value in (("level", level), ("normal level", normal_level)):
            if not 1 <= value <= levels:
                raise UserError(f"{name} {value}: the model has levels 1 to {levels}")
        return level, normal_level

    def check_texture(self, there: bool) -> None:
        """Raises UserError where a model without one is to show its texture."""
        if self.shading == "texture" and not there:
            raise UserError("the model has no texture (it was trained without one); use --shade phong or normal")

    def steps(self, defaults: tuple[int, ...]) -> tuple[int, ...]:
        """Iterations of each level, given the model's. Raises UserError where there are more numbers than levels."""
        given = self.iterations or defaults
        if len(given) > len(defaults):
            raise UserError(f"iterations: {len(given)} numbers for a model of {len(defaults)} levels")
        return given + given[-1:] * (len(defaults) - len(given))


def _whole(name: str, value: int, most: int) -> None:
    if not 1 <= value <= most:
        raise UserError(f"{name} {value}: a whole number from 1 to {most}")


def schedule_that_fits(
    shader: Shader, level: int, normal_level: int, steps: tuple[int, ...], rounds: int
) -> tuple[tuple[int, ...], int]:
    """Steps per level and rounds, at most those given, whose worst fragment stays within LOOP_LIMIT.

    Steps of the last level go first, down to `LEAST_STEPS`: it costs most, and a ray that is not done comes back in the
    next round. Raises UserError where even one round may not fit.
    """
    if shader.worst_loops(level, normal_level, steps, rounds) > LOOP_LIMIT:
        last = min(steps[level - 1], LEAST_STEPS)
        steps = (*steps[: level - 1], last, *steps[level:])
    while shader.worst_loops(level, normal_level, steps, rounds) > LOOP_LIMIT:
        rounds -= 1
        if rounds == 0:
            worst = shader.worst_loops(level, normal_level, steps, 1)
            raise UserError(
                f"software OpenGL stops a pixel after {LOOP_LIMIT} loop iterations and this needs up to {worst}; "
                "lower --iterations or --level, use --storage literal, or draw on a GPU (--context egl)"
            )
    return steps, rounds
