"""Checks that a program is as ir/program.py defines it."""

import numpy as np

from mplicits.ir.program import INPUT, Affine, Dot, Function, Op, Product, Program, Transposed


def check(program: Program) -> None:
    """Raise ValueError if a program is ill-formed."""
    for name, constant in program.constants.items():
        assert constant.dtype == np.float32, name
        assert not any(size % 4 for size in constant.shape), name
        assert np.isfinite(constant).all(), name
    if program.composition is not None:
        assert (program.values, program.gradients, program.texture) == ((), (), None)
        for part in program.composition.programs:
            check(part)
        return
    assert len(program.bands) == len(program.values) == len(program.gradients) > 0
    signatures = [(function, [1]) for function in program.values]
    signatures += [(function, [4, 1]) for function in program.gradients]
    signatures += [] if program.texture is None else [(program.texture, [1, 1, 1])]
    for function, outputs in signatures:
        check_function(program, function, outputs)


def check_function(program: Program, function: Function, outputs: list[int]) -> None:
    """Raise ValueError if a function is ill-formed or its outputs have other widths."""
    widths = {INPUT: 4}
    for op in function.ops:
        if op.result in widths or op.result in program.constants:
            raise ValueError(f"{function.name}: {op.result} is assigned twice")
        widths[op.result] = _width(program, op, widths)
    if any(name not in widths for name in function.outputs):
        raise ValueError(f"{function.name}: outputs are never assigned")
    if [widths[name] for name in function.outputs] != outputs:
        raise ValueError(f"{function.name}: its outputs are not {outputs} wide")
    assert widths == program.widths(function)


def _width(program: Program, op: Op, widths: dict[str, int]) -> int:
    """Return the width of an op's result. widths: of previous values."""

    def value(name: str) -> int:
        if name not in widths:
            raise ValueError(f"{op}: {name} is not defined")
        if widths[name] == 1:
            raise ValueError(f"{op}: {name} is a scalar")
        return widths[name]

    def constant(name: str, dimensions: int) -> tuple[int, ...]:
        if name not in program.constants or program.constants[name].ndim != dimensions:
            raise ValueError(f"{op}: {name} is not defined")
        return program.constants[name].shape

    def expect(condition: bool) -> None:
        if not condition:
            raise ValueError(f"{op}: widths differ")

    match op:
        case Affine(source=source, matrix=matrix, bias=bias):
            rows, columns = constant(matrix, 2)
            expect(value(source) == columns and (bias is None or constant(bias, 1) == (rows,)))
            return rows
        case Transposed(source=source, matrix=matrix):
            rows, columns = constant(matrix, 2)
            expect(value(source) == rows)
            return columns
        case Product(left=left, right=right):
            expect((value(left) if left in widths else constant(left, 1)[0]) == value(right))
            return value(right)
        case Dot(source=source, row=row):
            expect(constant(row, 1) == (value(source),))
            return 1
        case _:
            return value(op.source)
