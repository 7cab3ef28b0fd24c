"""Lowers a scene: its models' programs under different names, their placements, and how they are joined."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..model.expression import Expression, number, product
from ..model.model import Layer, Model, Network
from ..model.scene import SMOOTH_UNION, Disc, Group, Node, Placement
from .composition import MARGIN, Composition, Join, Leaf
from .prefixed import prefixed
from .program import Band, Program

PADDED = 16
"""Hidden layers of a scene's networks are padded with zeros to multiples of this width."""


def padded_networks(model: Model) -> Model:
    """Pad the hidden layers of a shape's model to multiples of PADDED; the model computes the same."""

    def padded(network: Network) -> Network:
        layers = []
        for j, layer in enumerate(network):
            rows = -len(layer.bias) % PADDED if j < len(network) - 1 else 0
            columns = -layer.weight.shape[1] % PADDED if j > 0 else 0
            layers.append(Layer(np.pad(layer.weight, ((0, rows), (0, columns))), np.pad(layer.bias, (0, rows))))
        return tuple(layers)

    levels = tuple(replace(level, network=padded(level.network)) for level in model.levels)
    return replace(model, levels=levels, texture=None if model.texture is None else padded(model.texture))


def lower_scene(model: Model, programs: Sequence[Program]) -> Program:
    """Return the program of a scene. programs: the programs of the scene's models."""
    assert model.scene is not None
    named = [prefixed(program, f"shape{i}") for i, program in enumerate(programs, start=1)]
    leaves: list[Leaf] = []
    root = _joined(model.scene, (), number(0), named, leaves)
    assert isinstance(root, Join)
    empty = Program(model.name, model.sha256(), bands(model), (), (), None, {})
    return scene_program(empty, tuple(leaves), root, moving=model.inputs == "xyzt")


def scene_program(program: Program, leaves: tuple[Leaf, ...], root: Join, moving: bool) -> Program:
    """Return a program with another composition. Leaves whose programs have the same name share the program."""
    named = {leaf.part.values[0].name: leaf.part for leaf in leaves if isinstance(leaf.part, Program)}
    programs = tuple(named.values())
    constants = {name: constant for part in programs for name, constant in part.constants.items()}
    composition = Composition(programs, leaves, root)
    result = replace(program, composition=composition, constants=constants, moving=moving)
    result.check()
    return result


def bands(model: Model) -> tuple[Band, ...]:
    """Return the parameters of sphere tracing of each level."""
    return tuple(Band(level.delta, level.iterations, level.step_bound, level.band_step_bound) for level in model.levels)


def _joined(
    node: Node, places: tuple[Placement, ...], seam: Expression, programs: Sequence[Program], leaves: list[Leaf]
) -> Join | int:
    """Convert a node; append its leaves to `leaves`.

    places: placements of the groups around the node, the outermost first. seam: largest radius of a smooth union around
    the node, in the scene's units.
    """
    places = (*places, node.placement)
    scale = product(*(place.scale for place in places))
    if isinstance(node, Group):
        radius = product(node.radius, scale)
        if node.operation == SMOOTH_UNION:
            seam = _largest(seam, radius)
        return Join(node.operation, radius, tuple(_joined(part, places, seam, programs, leaves) for part in node.parts))
    margin = _largest(number(MARGIN), seam if scale == number(1) else Expression("/", operands=(seam, scale)))
    if isinstance(node, Disc):
        leaves.append(Leaf(node, places, number(0), number(0)))
    else:
        leaves.append(Leaf(programs[node.model], places, node.time, margin))
    return len(leaves) - 1


def _largest(a: Expression, b: Expression) -> Expression:
    """Return the larger of two expressions."""
    largest = Expression("max", operands=(a, b))
    return largest if largest.moves else number(largest.at(0.0))
