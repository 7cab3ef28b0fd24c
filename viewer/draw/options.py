"""What a picture shows besides the camera's view, and the bounds within which a driver draws it right."""

import math
from dataclasses import dataclass

from ...codegen.targets.shader import LEAST_STEPS, LOOP_LIMIT, Shader
from ...codegen.targets.uniforms import SCHEDULES, SHADINGS
from ...model.errors import UserError
from ...model.model import MOST_ITERATIONS

MAX_SAMPLES = 256
"""Most rays per pixel."""
MAX_ROUNDS = 1000
"""Most rounds; of the iterations, a model file has the bound."""


@dataclass(frozen=True)
class RenderOptions:
    """What a picture shows of a model; None stands for the shader's default.

    Raises UserError where a number is out of range.
    """

    level: int | None = None
    """Last level that is traced; None: all are."""
    normal_level: int | None = None
    """Level whose gradient is the normal; None: that of `level`. A finer one is normal mapping (Section 3.2)."""
    shade: str = "phong"
    """One of SHADINGS."""
    schedule: str = "relaxed"
    """How rays are traced, one of SCHEDULES."""
    iterations: tuple[int, ...] | None = None
    """Sphere tracing steps per level and round; the last number stands for the levels that are not given."""
    rounds: int | None = None
    """How often a ray may start again from level 1."""
    delta_scale: float = 1.0
    """Factor on the widths of the bands."""
    step_scale: float | None = None
    """Factor on every step."""
    samples: int = 1
    """Rays per pixel, at most."""
    uniform: bool = False
    """Whether every pixel gets all of them; else a pixel of the shape gets a seventh in the mean, most at its edges."""
    time: float = 0.0
    """Moment from 0 to 1 of a model that moves; 0 for others."""
    light: tuple[float, float, float] | None = None
    """Direction towards the light, of any length, in camera space."""
    background: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    """Colours at the top and at the bottom, sRGB in [0, 1]."""
    transparent: bool = False
    """Whether alpha is coverage, and the background is left out of the colours."""
    plain: bool = False
    """Whether the model's colours are left out."""
    split: float = 0.0
    """Share of the width, from the left, with the normals of `level`, or with a mesh's own."""

    def __post_init__(self) -> None:
        if self.shade not in SHADINGS:
            raise UserError(f"shade {self.shade!r} is none of {', '.join(SHADINGS)}")
        if self.schedule not in SCHEDULES:
            raise UserError(f"schedule {self.schedule!r} is none of {', '.join(SCHEDULES)}")
        _check_number("samples", self.samples, MAX_SAMPLES)
        for steps in self.iterations or ():
            _check_number("iterations", steps, MOST_ITERATIONS)
        if self.rounds is not None:
            _check_number("rounds", self.rounds, MAX_ROUNDS)
        for name, factor in (("delta scale", self.delta_scale), ("step scale", self.step_scale)):
            if factor is not None and not 0.0 < factor <= 100.0:
                raise UserError(f"{name} {factor:g}: more than 0, at most 100")
        if not 0.0 <= self.time <= 1.0:
            raise UserError(f"time {self.time:g}: a moment from 0 to 1")
        if not 0.0 <= self.split <= 1.0:
            raise UserError(f"split {self.split:g}: a share from 0 to 1")
        if self.light is not None and not (all(map(math.isfinite, self.light)) and any(self.light)):
            raise UserError("light: a direction, three finite numbers that are not all 0")

    def resolved_levels(self, levels: int) -> tuple[int, int]:
        """Return (level, normal level) for a model with this number of levels, without None.

        Raises UserError where the model has no such level.
        """
        level = levels if self.level is None else self.level
        normal_level = level if self.normal_level is None else self.normal_level
        for name, value in (("level", level), ("normal level", normal_level)):
            if not 1 <= value <= levels:
                raise UserError(f"{name} {value}: the model has levels 1 to {levels}")
        return level, normal_level

    def check_texture(self, textured: bool) -> None:
        """Raise UserError where the texture is to be shown of a model that is not `textured`."""
        if self.shade == "texture" and not textured:
            raise UserError("the model has no texture (it was trained without one); use --shade phong or normal")

    def resolved_iterations(self, defaults: tuple[int, ...]) -> tuple[int, ...]:
        """Return the iterations of each level, where `defaults` are the model's own.

        Raises UserError where there are more numbers than levels.
        """
        given = self.iterations or defaults
        if len(given) > len(defaults):
            raise UserError(f"iterations: {len(given)} numbers for a model of {len(defaults)} levels")
        return given + given[-1:] * (len(defaults) - len(given))


def _check_number(name: str, value: int, most: int) -> None:
    """Raise UserError where a number of things is not in 1 .. most."""
    if not 1 <= value <= most:
        raise UserError(f"{name} {value}: a whole number from 1 to {most}")


def schedule_that_fits(
    shader: Shader, level: int, normal_level: int, iterations: tuple[int, ...], rounds: int, schedule: str
) -> tuple[tuple[int, ...], int]:
    """Return iterations of each level and rounds, at most those given, whose worst fragment stays within LOOP_LIMIT.

    level: last level that is traced; normal_level: level of the normals. The last level loses steps first, down to
    LEAST_STEPS: it costs most, and a ray that is not done comes back in the next round. Raises UserError where even
    one round may not fit.
    """
    if shader.worst_loops(level, normal_level, iterations, rounds, schedule) > LOOP_LIMIT:
        last = min(iterations[level - 1], LEAST_STEPS)
        iterations = (*iterations[: level - 1], last, *iterations[level:])
    while shader.worst_loops(level, normal_level, iterations, rounds, schedule) > LOOP_LIMIT:
        rounds -= 1
        if rounds == 0:
            worst = shader.worst_loops(level, normal_level, iterations, 1, schedule)
            raise UserError(
                f"software OpenGL stops a pixel after {LOOP_LIMIT} loop iterations and this needs up to {worst}; "
                "lower --iterations or --level, use --storage literal, or draw on a GPU (--context egl)"
            )
    return iterations, rounds
