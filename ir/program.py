"""The program: what a model computes, written in seven ops. Every target prints it, and the numpy reference runs it.

This file is the definition. A printer for another language needs nothing else; field/interpret.py says the
same in numpy, for tests.

**Functions.** A `Function` is a list of ops without branches or loops. Each op assigns one new value, which later ops
refer to by name. The function's input has the name `INPUT`; its results are the values that `outputs` names. Names of
values are local to their function and are identifiers in any C-like language.

**Values.** A value is a vector of 32-bit floats, made of n blocks of four: block k, a vec4, holds the components 4 k to
4 k + 3. Only the result of a `Dot` is a scalar, and no op takes a scalar. `Program.widths` gives the number of
components of each value.

**Constants.** The weights are in `Program.constants`, by name, and shared by all functions: a network's value and its
gradient read the same matrices. A matrix is (rows, columns), one row for each component of the product; block (o, i)
of it, rows 4 o to 4 o + 3 and columns 4 i to 4 i + 3, is a mat4 that takes block i of the source to block o of the
result. A vector is (n,).

**Padding.** Sizes that are not multiples of 4 are filled up with zeros at the end: rows and columns of matrices, and
entries of vectors. So a value has padded components as well, in which Affine and Sine give 0 and Cosine gives 1. They
never reach an output: whatever they are multiplied by is zero in the end.

**What the functions give together.** With f_level = values[0] + ... + values[level - 1], each at the same input:

- the field at a point is f_i of the finest level i that is defined there. Level 1 is defined everywhere, and level
  i + 1 where level i is and |f_i| < bands[i - 1].delta (Eq. 3).
- the gradient of f_level is the sum of the first outputs of gradients[0] to gradients[level - 1].
- the colour is `texture`'s output, clamped to [0, 1], sRGB; a model without one is painted by the target.

Of a scene, the program has the functions of all its models, and composition.py says what they give together.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .composition import Composition

Array = NDArray[np.float32]

INPUT = "p"
"""Name of every function's input, one vec4 in model space: (x, y, z, 1), or (x, y, z, t) where the field moves."""


@dataclass(frozen=True)
class Affine:
    """result = matrix source + bias: a layer of a network, before its sine."""

    result: str
    """Name of the new value; as wide as the matrix has rows."""
    source: str
    """A value, as wide as the matrix has columns."""
    matrix: str
    """A constant, (rows, columns)."""
    bias: str | None
    """A constant, (rows,). None adds nothing: the bias is then the column of the matrix that meets the input's 1."""


@dataclass(frozen=True)
class Transposed:
    """result = transpose(matrix) source: the adjoint of Affine, with the same constant."""

    result: str
    """Name of the new value; as wide as the matrix has columns."""
    source: str
    """A value, as wide as the matrix has rows."""
    matrix: str
    """A constant, (rows, columns)."""


@dataclass(frozen=True)
class Sine:
    """result = sin(source), component by component, of angles in radians."""

    result: str
    """Name of the new value, as wide as the source."""
    source: str
    """A value."""


@dataclass(frozen=True)
class Cosine:
    """result = cos(source), component by component, of angles in radians."""

    result: str
    """Name of the new value, as wide as the source."""
    source: str
    """A value."""


@dataclass(frozen=True)
class Product:
    """result = left * right, component by component."""

    result: str
    """Name of the new value, as wide as the factors."""
    left: str
    """A value, or a constant vector."""
    right: str
    """A value."""


@dataclass(frozen=True)
class Dot:
    """result = scale * (row . source) + bias: one output of a network, a scalar."""

    result: str
    """Name of the new value, which has one component."""
    source: str
    """A value."""
    row: str
    """A constant vector, as wide as the source."""
    scale: float
    """Factor of the product; 1 unless the row was rounded (see lower)."""
    bias: float
    """Added after scaling."""


@dataclass(frozen=True)
class Scale:
    """result = factor * source."""

    result: str
    """Name of the new value, as wide as the source."""
    source: str
    """A value."""
    factor: float
    """A number, the same for every component."""


Op = Affine | Transposed | Sine | Cosine | Product | Dot | Scale


@dataclass(frozen=True)
class Function:
    """Ops in the order in which they run, from one input to one or more outputs."""

    name: str
    """Unique in the program, an identifier."""
    ops: tuple[Op, ...]
    """Each assigns one value, from the input and the values before it."""
    outputs: tuple[str, ...]
    """Names of the values that it returns."""


@dataclass(frozen=True)
class Cost:
    """The work of one evaluation; padded components count."""

    multiply_adds: int
    """Products, most of which are added to a sum."""
    sines: int
    """Sines and cosines."""

    def __add__(self, other: "Cost") -> "Cost":
        return Cost(self.multiply_adds + other.multiply_adds, self.sines + other.sines)


@dataclass(frozen=True)
class Band:
    """The numbers that sphere tracing has for one level."""

    delta: float
    """Half width of the band |f_i| < delta in which the next finer level is defined (Eq. 3), model units."""
    iterations: int
    """Steps at this level per round."""
    step_bound: float
    """Factor on the steps of this level where it is the last that is traced, in (0, 1]."""
    band_step_bound: float
    """Factor on its steps where a finer level is traced, in (0, 1]."""


@dataclass(frozen=True, eq=False)
class Program:
    """A model, lowered to functions and constants; see this file's docstring."""

    name: str
    """The model's name: any text, so it may stand in generated code only escaped."""
    sha256: str
    """Hash of the model, hexadecimal."""
    bands: tuple[Band, ...]
    """One for each level, the coarsest first."""
    values: tuple[Function, ...]
    """For each level, its network alone: level 1's distance, or a finer level's residual. Output: (f,), a scalar."""
    gradients: tuple[Function, ...]
    """For each level, the network's gradient and value. Outputs: (gradient, f), a vec4 and a scalar. The gradient's
    first three components are the derivatives along x, y and z; the fourth has no use."""
    texture: Function | None
    """The colour's network, or None. Outputs: (r, g, b), three scalars, sRGB, not yet clamped."""
    constants: dict[str, Array]
    """Name -> float32 matrix (rows, columns) or vector (n,), sizes padded with zeros to multiples of 4."""
    moving: bool = False
    """Whether the fourth component of the input is time; else it is 1, for the first layer's bias."""
    composition: "Composition | None" = None
    """Of a scene, which has neither values nor gradients nor a texture of its own."""

    @property
    def coloured(self) -> bool:
        """Whether the program gives colours."""
        return self.texture is not None or self.composition is not None

    def functions(self) -> tuple[Function, ...]:
        """Return all functions: values, then gradients, then the texture; none calls another."""
        if self.composition is not None:
            return tuple(function for program in self.composition.programs for function in program.functions())
        return (*self.values, *self.gradients, *(() if self.texture is None else (self.texture,)))

    def widest(self, function: Function) -> int:
        """Return the largest side of the matrices that a function multiplies by."""
        products = (op for op in function.ops if isinstance(op, Affine | Transposed))
        return max(int(max(self.constants[op.matrix].shape)) for op in products)

    def widths(self, function: Function) -> dict[str, int]:
        """Return the number of components of each value of a function, the input included.

        Raises ValueError where an op refers to what is not there, or to vectors of other widths than it takes.
        """
        widths = {INPUT: 4}
        for op in function.ops:
            if op.result in widths or op.result in self.constants:
                raise ValueError(f"{function.name}: {op.result} is assigned twice")
            widths[op.result] = self._width(op, widths)
        missing = [name for name in function.outputs if name not in widths]
        if missing:
            raise ValueError(f"{function.name}: outputs {missing} are never assigned")
        return widths

    def check(self) -> None:
        """Raise ValueError where the program is not as this file defines it."""
        for name, constant in self.constants.items():
            if constant.dtype != np.float32 or any(size % 4 for size in constant.shape) or constant.ndim > 2:
                raise ValueError(f"{name}: constants are float32, sizes multiples of 4")
            if not np.isfinite(constant).all():
                raise ValueError(f"{name}: not finite")
        if self.composition is not None:
            if self.values or self.gradients or self.texture is not None:
                raise ValueError("a scene has no functions beside its models'")
            for program in self.composition.programs:
                program.check()
            return
        if not len(self.bands) == len(self.values) == len(self.gradients) > 0:
            raise ValueError("every level needs a band, a value and a gradient")
        signatures = [(function, [1]) for function in self.values]
        signatures += [(function, [4, 1]) for function in self.gradients]
        signatures += [] if self.texture is None else [(self.texture, [1, 1, 1])]
        for function, outputs in signatures:
            widths = self.widths(function)
            if [widths[name] for name in function.outputs] != outputs:
                raise ValueError(f"{function.name}: its outputs are not {outputs} wide")

    def cost(self, function: Function) -> Cost:
        """Count the work of one call of a function."""
        widths = self.widths(function)
        multiply_adds = sines = 0
        for op in function.ops:
            match op:
                case Affine(matrix=matrix) | Transposed(matrix=matrix):
                    multiply_adds += self.constants[matrix].size
                case Sine() | Cosine():
                    sines += widths[op.result]
                case Dot(source=source):
                    multiply_adds += widths[source]
                case Product() | Scale():
                    multiply_adds += widths[op.result]
        return Cost(multiply_adds, sines)

    def value_costs(self) -> tuple[Cost, ...]:
        """Count the work of each level's value alone; of a scene, where all its shapes are asked."""
        if self.composition is None:
            return tuple(self.cost(function) for function in self.values)
        costs = [Cost(0, 0)] * len(self.bands)
        for leaf in self.composition.leaves:
            if isinstance(leaf.part, Program):
                for i, cost in enumerate(leaf.part.value_costs()[: len(costs)]):
                    costs[i] += cost
        return tuple(costs)

    def _width(self, op: Op, widths: dict[str, int]) -> int:
        """Return the width of an op's result. widths: those of the values before it. Raises ValueError as `widths`."""

        def value(name: str) -> int:
            if name not in widths:
                raise ValueError(f"{op}: {name} is not defined")
            if widths[name] == 1:
                raise ValueError(f"{op}: {name} is a scalar")
            return widths[name]

        def constant(name: str, dimensions: int) -> tuple[int, ...]:
            if name not in self.constants or self.constants[name].ndim != dimensions:
                raise ValueError(f"{op}: {name} is not defined")
            return self.constants[name].shape

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
