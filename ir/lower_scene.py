"""Lowers scenes: renames the programs of the models, and places and joins them."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..model.expression import Expression, number, product
from ..model.model import Layer, Model, Network
from ..model.scene import SMOOTH_UNION, Disc, Group, Node, Placement
from .composition import MARGIN, Composition, Join, Leaf
from .program import Band, Function, Op, Program

PADDED = 16
"""Hidden layers of a scene's networks are zero-padded to multiples of this."""


def padded_networks(model: Model) -> Model:
    """Zero-pad the hidden layers of a model of one shape to multiples of PADDED."""

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
    """Return the program of a scene from the programs of its models."""
    assert model.scene is not None
    named = [prefixed(program, f"shape{i}") for i, program in enumerate(programs, start=1)]
    leaves: list[Leaf[Program]] = []
    root = _joined(model.scene, (), number(0), named, leaves)
    assert isinstance(root, Join)
    empty = Program(model.name, model.sha256(), bands(model), (), (), None, {})
    return scene_program(empty, tuple(leaves), root, moving=model.inputs == "xyzt")


def scene_program(program: Program, leaves: tuple[Leaf[Program], ...], root: Join, moving: bool) -> Program:
    """Return a program with another composition; leaves with the same program share it."""
    named = {leaf.part.values[0].name: leaf.part for leaf in leaves if isinstance(leaf.part, Program)}
    programs = tuple(named.values())
    constants = {name: constant for part in programs for name, constant in part.constants.items()}
    composition = Composition(programs, leaves, root)
    return replace(program, composition=composition, constants=constants, moving=moving)


def prefixed(program: Program, name: str) -> Program:
    """Prefix the names of a program's functions and constants with `name` and an underscore, to make them unique."""
    names = {constant: f"{name}_{constant}" for constant in program.constants}

    def op(old: Op) -> Op:
        texts = {entry.name: getattr(old, entry.name) for entry in fields(old)}
        renamed: dict[str, Any] = {key: names[text] for key, text in texts.items() if text in names}
        return replace(old, **renamed)

    def function(old: Function) -> Function:
        return replace(old, name=f"{name}_{old.name}", ops=tuple(op(entry) for entry in old.ops))

    composition = program.composition
    if composition is not None:
        parts = {id(part): prefixed(part, name) for part in composition.programs}
        leaves = tuple(replace(leaf, part=parts.get(id(leaf.part), leaf.part)) for leaf in composition.leaves)
        composition = replace(composition, programs=tuple(parts.values()), leaves=leaves)
    return replace(
        program,
        composition=composition,
        constants={names[key]: constant for key, constant in program.constants.items()},
        values=tuple(map(function, program.values)),
        gradients=tuple(map(function, program.gradients)),
        texture=None if program.texture is None else function(program.texture),
    )


def bands(model: Model) -> tuple[Band, ...]:
    return tuple(Band(level.delta, level.iterations, level.step_bound, level.band_step_bound) for level in model.levels)


def _joined(
    node: Node,
    places: tuple[Placement, ...],
    seam: Expression,
    programs: Sequence[Program],
    leaves: list[Leaf[Program]],
) -> Join | int:
    """Return a node as a join of leaves, which are appended to `leaves`.

    places: placements of the enclosing groups, the outermost first. seam: largest radius of an enclosing smooth union,
    in the scene's units.
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
