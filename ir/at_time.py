"""Converts a moving program to a program of (x, y, z) at a fixed time."""

from dataclasses import replace

import numpy as np

from ..model.expression import Expression, number
from ..model.scene import Placement
from .composition import Composition, Join, Leaf
from .lower_scene import prefixed, scene_program
from .program import Affine, Array, Function, Program

SAMPLED_TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Times at which slow searches evaluate a moving field."""


def at_sampled_times(program: Program) -> tuple[Program, ...]:
    """Return a moving program at each of SAMPLED_TIMES, or only the program if it does not move."""
    return tuple(at_time(program, time) for time in SAMPLED_TIMES) if program.moving else (program,)


def at_time(program: Program, time: float) -> Program:
    """Return a moving program at one time. Programs without motion are returned unchanged.

    Time enters a network only through the last column of its first matrix. That column times `time`, plus the bias,
    becomes the column for the constant 1 in the input of a model without motion (lower.py).
    """
    if not program.moving:
        return program
    if program.composition is not None:
        return _scene_at(program, program.composition, time)
    constants = dict(program.constants)

    def function_at(function: Function) -> Function:
        first = function.ops[0]
        assert isinstance(first, Affine)
        assert first.bias is not None
        constants[first.matrix] = _matrix_at(program.constants[first.matrix], program.constants[first.bias], time)
        constants.pop(first.bias, None)
        return replace(function, ops=(replace(first, bias=None), *function.ops[1:]))

    return replace(
        program,
        values=tuple(map(function_at, program.values)),
        gradients=tuple(map(function_at, program.gradients)),
        texture=None if program.texture is None else function_at(program.texture),
        constants=constants,
        moving=False,
    )


def _scene_at(program: Program, composition: Composition[Program], time: float) -> Program:
    """Return a scene at one time. Every leaf gets a separate program."""

    def fixed(value: Expression) -> Expression:
        return number(value.at(time))

    def place_at(place: Placement) -> Placement:
        x, y, z = map(fixed, place.translate)
        return replace(place, translate=(x, y, z), angle=fixed(place.angle), scale=fixed(place.scale))

    def join_at(node: Join | int) -> Join | int:
        if not isinstance(node, Join):
            return node
        return replace(node, radius=fixed(node.radius), parts=tuple(map(join_at, node.parts)))

    leaves = []
    for i, leaf in enumerate(composition.leaves):
        part = leaf.part
        if isinstance(part, Program):
            part = prefixed(at_time(part, leaf.time.at(time)), f"leaf{i}")
        leaves.append(Leaf(part, tuple(map(place_at, leaf.places)), fixed(leaf.time), fixed(leaf.margin)))
    root = join_at(composition.root)
    assert isinstance(root, Join)
    return scene_program(program, tuple(leaves), root, moving=False)


def _matrix_at(matrix: Array, bias: Array, time: float) -> Array:
    """Fold time and bias into the last column of a matrix (rows, 4) that multiplies (x, y, z, t)."""
    last = matrix[:, 3].astype(np.float64) * time + bias
    return np.concatenate([matrix[:, :3], last[:, None].astype(np.float32)], axis=1)
