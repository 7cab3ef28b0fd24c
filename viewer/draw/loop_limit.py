"""Fits a ray's schedule into the loop limit of software OpenGL."""

from ...codegen.targets.shader import LEAST_STEPS, LOOP_LIMIT, Shader
from ...model.errors import UserError


def schedule_that_fits(
    shader: Shader, level: int, normal_level: int, iterations: tuple[int, ...], rounds: int, schedule: str
) -> tuple[tuple[int, ...], int]:
    """Return iterations of each level, and rounds, whose worst fragment stays within LOOP_LIMIT.

    level: last level that is traced. normal_level: level of the normals. The last level loses steps first, down to
    LEAST_STEPS: it costs most, and an unfinished ray continues in the next round. Raises UserError where not even one
    round is sure to fit.
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
