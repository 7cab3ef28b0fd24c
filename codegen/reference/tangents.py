"""The paper's Algorithm 1 (Appendix E) in the program's ops: value and gradient by one pass with three tangents.

`lower` writes the gradient as an adjoint pass, with half the products; this is what that is measured against.
"""

import dataclasses

from ..ir.program import INPUT, Affine, Cosine, Dot, Function, Op, Product, Program, Sine

AXES = "xyz"


def with_tangents(program: Program, level: int) -> tuple[Program, Function]:
    """`program` with W_0's columns as further constants, and a function of them: level's network by Algorithm 1.

    Its outputs are the derivatives of the network along x, y and z, and its value; each is (N, 1).
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
    """The names of the derivatives of `name` along each axis."""
    return [f"{name}_{axis}" for axis in AXES]
