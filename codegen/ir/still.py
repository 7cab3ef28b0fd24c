"""The field of a model that moves at one moment: a program of (x, y, z), for all that knows of no time."""

from dataclasses import replace

import numpy as np

from .program import Affine, Array, Function, Program

SAMPLED = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Times at which a field that moves is looked at, where looking at all of them would take too long."""


def stills(program: Program) -> tuple[Program, ...]:
    """Return what a program computes at the times SAMPLED; a program that does not move alone, as it is."""
    return tuple(still(program, time) for time in SAMPLED) if program.moving else (program,)


def still(program: Program, time: float) -> Program:
    """Return what a program computes at one time; a program that does not move is returned as it is.

    Time enters a network by the last column of its first matrix alone. Times the moment, and with the bias added, that
    is the column for the input's 1 of a model that does not move (see lower).
    """
    if not program.moving:
        return program
    constants = dict(program.constants)

    def stilled(function: Function) -> Function:
        first = function.ops[0]
        assert isinstance(first, Affine)
        assert first.bias is not None
        constants[first.matrix] = _at(program.constants[first.matrix], program.constants[first.bias], time)
        constants.pop(first.bias, None)
        return replace(function, ops=(replace(first, bias=None), *function.ops[1:]))

    return replace(
        program,
        values=tuple(map(stilled, program.values)),
        gradients=tuple(map(stilled, program.gradients)),
        texture=None if program.texture is None else stilled(program.texture),
        constants=constants,
        moving=False,
    )


def _at(matrix: Array, bias: Array, time: float) -> Array:
    """Fold the time, and the bias, into the last column of a matrix (rows, 4) that meets (x, y, z, t)."""
    last = matrix[:, 3].astype(np.float64) * time + bias
    return np.concatenate([matrix[:, :3], last[:, None].astype(np.float32)], axis=1)
