"""The field of a model that moves at one moment: a program of (x, y, z), for all that knows of no time."""

from dataclasses import replace

import numpy as np

from ...model.expression import Expression, number
from ...model.scene import Placement
from .composition import Composition, Join, Leaf
from .lower_scene import scene_program
from .prefixed import prefixed
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
    if program.composition is not None:
        return _still_scene(program, program.composition, time)
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


def _still_scene(program: Program, composition: Composition, time: float) -> Program:
    """Return a scene at one time, in which every leaf has a program of its own."""

    def at(value: Expression) -> Expression:
        return number(value.at(time))

    def placed(place: Placement) -> Placement:
        x, y, z = map(at, place.translate)
        return replace(place, translate=(x, y, z), angle=at(place.angle), scale=at(place.scale))

    def joined(node: Join | int) -> Join | int:
        if not isinstance(node, Join):
            return node
        return replace(node, radius=at(node.radius), parts=tuple(map(joined, node.parts)))

    leaves = []
    for i, leaf in enumerate(composition.leaves):
        part = leaf.part
        if isinstance(part, Program):
            part = prefixed(still(part, leaf.time.at(time)), f"leaf{i}")
        leaves.append(Leaf(part, tuple(map(placed, leaf.places)), at(leaf.time), at(leaf.margin)))
    root = joined(composition.root)
    assert isinstance(root, Join)
    return scene_program(program, tuple(leaves), root, moving=False)


def _at(matrix: Array, bias: Array, time: float) -> Array:
    """Fold the time, and the bias, into the last column of a matrix (rows, 4) that meets (x, y, z, t)."""
    last = matrix[:, 3].astype(np.float64) * time + bias
    return np.concatenate([matrix[:, :3], last[:, None].astype(np.float32)], axis=1)
