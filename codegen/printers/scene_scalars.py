"""A scene's field as scalars without loops (codegen/ir/composition.py): every network is a function with constants.

scene_loops.py prints the same field with loops over tables, for weights in a texture.
"""

from collections.abc import Sequence

from ...ir.composition import Join
from ...ir.program import Program
from ...model.model import DELTA_FACTOR
from ...model.scene import DIFFERENCE, SMOOTH_UNION, UNION
from .scalars import Number, Triple, Writer
from .scene_leaf import LeafAtPoint


class SceneAtPoint:
    """A scene's field, gradient and color at one point."""

    def __init__(
        self,
        program: Program,
        writer: Writer,
        point: Triple,
        level: str | None = None,
        deltas: Sequence[Number] | None = None,
    ) -> None:
        """Write the field up to the level in the variable `level` (from 1), or with None up to the finest level.

        deltas: the scene's band half-widths; None for the program's.
        """
        assert program.composition is not None
        w = self._w = writer
        self._root = program.composition.root
        self.value: Number = 0.0
        """The field."""
        self.reached: Number = 1.0
        """The finest level that is defined at the point."""
        self._leaves = [LeafAtPoint(leaf, w, point) for leaf in program.composition.leaves]
        defined: str | None = None
        self.defined: list[str] = []
        """The conditions on which level 2 and each further one is defined."""
        self._outside: list[tuple[str, Number]] = []
        for k in range(len(program.bands)):
            if k > 0:
                delta = program.bands[k - 1].delta if deltas is None else deltas[k - 1]
                size = w.let(w.call("abs", self.value))
                inside, outside = w.less(size, delta), w.less(delta, size)
                if level:
                    inside, outside = (w.both(f"({level} > {k})", entry) for entry in (inside, outside))
                self._outside.append((outside, w.sub(self.value, w.div(delta, DELTA_FACTOR))))
                defined = w.let_condition(w.both(defined, inside) if defined else inside)
                self.defined.append(defined)
                self.reached = w.add(self.reached, w.pick(defined, 1.0, 0.0))
            for leaf in self._leaves:
                leaf.refine(k, defined)
            self.value = w.let(self._join(self._root)[0])

    def outside_bands(self) -> Number:
        """Return the field inside all bands; elsewhere the distance to the outermost band's offset surface."""
        value = self.value
        for outside, distance in reversed(self._outside):
            value = self._w.let(self._w.pick(outside, distance, value))
        return value

    def gradient(self) -> Triple:
        """Return the gradient of the field."""
        return self._weighted([(share, leaf.gradient(share)) for share, leaf in self._shares()])

    def color(self, plain: tuple[float, float, float]) -> Triple:
        """Return the color, sRGB. plain: color of shapes without a texture."""
        sizes = [(self._w.let(self._w.call("abs", share)), leaf) for share, leaf in self._shares()]
        return self._weighted([(size, leaf.color(size, plain)) for size, leaf in sizes])

    def _shares(self) -> list[tuple[Number, LeafAtPoint]]:
        """Return each leaf with its share in the field."""
        _, shares = self._join(self._root, shares=True)
        return [(shares[i], leaf) for i, leaf in enumerate(self._leaves)]

    def _weighted(self, parts: list[tuple[Number, Triple]]) -> Triple:
        """Return the sum of vectors, each times its share."""
        w, sums = self._w, list[Number]([0.0, 0.0, 0.0])
        for share, vector in parts:
            sums = [w.let(w.add(a, w.mul(share, b))) for a, b in zip(sums, vector, strict=True)]
        return sums[0], sums[1], sums[2]

    def _join(self, node: Join | int, shares: bool = False) -> tuple[Number, dict[int, Number]]:
        """Return a node's value and, with `shares`, its leaves' shares in it."""
        w = self._w
        if not isinstance(node, Join):
            return self._leaves[node].distance, {node: 1.0}
        total, kept = self._join(node.parts[0], shares)
        for part in node.parts[1:]:
            value, own = self._join(part, shares)
            sign = 1.0
            if node.operation == SMOOTH_UNION:
                radius = w.let(w.expression(node.radius))
                blend = w.div(w.mul(w.sub(value, total), 0.5), radius)
                share = w.let(w.clamped(w.add(blend, 0.5)))
                other = w.let(w.sub(1.0, share))
                dip = w.mul(w.mul(radius, share), other)
                joined = w.sub(w.add(w.mul(share, total), w.mul(other, value)), dip)
            else:
                if node.operation == DIFFERENCE:
                    sign, value = -1.0, w.let(w.sub(0.0, value))
                first, second = (total, value) if node.operation == UNION else (value, total)
                joined = w.call("min" if node.operation == UNION else "max", total, value)
                # The first part wins a tie.
                other = w.let(w.pick(w.less(second, first), 1.0, 0.0)) if shares else 0.0
                share = w.let(w.sub(1.0, other))
            if shares:
                kept = {i: w.let(w.mul(share, weight)) for i, weight in kept.items()}
                kept |= {i: w.let(w.mul(w.mul(sign, other), weight)) for i, weight in own.items()}
            total = w.let(joined)
        return total, kept
