"""The paper's Algorithm 1 (Appendix E) in the program's ops: one pass computes a value and three tangents beside it.

A tangent is the derivative of a value along x, y or z. `lower` writes the gradient as an adjoint pass instead, which
takes half the products; this is what it is measured against.
"""

import dataclasses

from mplicits.ir.program import INPUT, Affine, Cosine, Dot, Function, Op, Product, Program, Sine

AXES = "xyz"
"""Each axis ends the names of the derivatives along it."""


def with_tangents(program: Program, level: int) -> tuple[Program, Function]:
    """Write a level's network as Algorithm 1 computes it.

    Returns the program with further constants, the columns of the first matrix, and the function that uses them. Its
    outputs are four scalars: the network's derivatives along x, y and z, and its value. Raises TypeError where the
    value has ops that a network's value does not have.
    """
    value = program.values[level - 1]
    constants = dict(program.constants)
    ops: list[Op] = []
    tangents: dict[str, list[str]] = {}
    for op in value.ops:
        if not isinstance(op, Affine | Sine | Dot):
            raise TypeError(f"{op}: no part of a network's value")
        ops.append(op)
        if isinstance(op, Affine) and op.source == INPUT:
            tangents[op.result] = named(op.matrix)
            constants |= {name: constants[op.matrix][:, j].copy() for j, name in enumerate(named(op.matrix))}
            continue
        sources, tangents[op.result] = tangents[op.source], named(op.result)
        pairs = list(zip(named(op.result), sources, strict=True))
        match op:
            case Affine(matrix=matrix):
                ops += [Affine(result, source, matrix, None) for result, source in pairs]
            case Sine():
                slope = f"{op.result}_slope"
                ops.append(Cosine(slope, op.source))
                ops += [Product(result, source, slope) for result, source in pairs]
            case Dot(row=row, scale=scale):
                ops += [Dot(result, source, row, scale, 0.0) for result, source in pairs]
    (f,) = value.outputs
    function = Function(f"{value.name}_tangents", tuple(ops), (*tangents[f], f))
    return dataclasses.replace(program, constants=constants), function


def named(name: str) -> list[str]:
    """Return the names of the derivatives of the value `name` along each axis."""
    return [f"{name}_{axis}" for axis in AXES]
