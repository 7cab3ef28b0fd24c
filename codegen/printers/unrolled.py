"""The field of a scene as scalars without loops: ir/composition.py for functions alone and for Shadertoy.

composed.py prints the same with loops over tables, for networks whose weights are in a texture. Here a network is a
function with its weights as constants, which is called where a point is in its shape's ball.
"""

from collections.abc import Sequence

from ...ir.composition import OFFSET, Join
from ...ir.program import Program
from ...model.scene import DIFFERENCE, SMOOTH_UNION, UNION
from .scalars import Notation, Number, Scalar, Writer
from .scene_leaf import LeafAtPoint, Triple


class Unrolled:
    """The lines that compute a scene's field at one point, and then what else is asked of it there."""

    def __init__(
        self,
        program: Program,
        notation: Notation,
        point: tuple[str, str, str],
        time: str = "time",
        level: str | None = None,
        deltas: Sequence[Number] | None = None,
    ) -> None:
        """Compute the field, to the finest level or up to the one, from 1, in the variable `level`.

        point, time: variables. deltas: half widths of the scene's bands, None for those of the program.
        """
        assert program.composition is not None
        w = self._w = Writer(notation, time)
        x, y, z = map(Scalar, point)
        self._root = program.composition.root
        self.value: Number = 0.0
        """The field."""
        self.reached: Number = 1.0
        """The level that it is of."""
        self._leaves = [LeafAtPoint(leaf, w, (x, y, z)) for leaf in program.composition.leaves]
        defined: str | None = None
        self._outside: list[tuple[str, Number]] = []
        for k in range(len(program.bands)):
            if k > 0:
                delta = program.bands[k - 1].delta if deltas is None else deltas[k - 1]
                size = w.let(w.call("abs", self.value))
                inside, outside = w.less(size, delta), w.less(delta, size)
                if level:
                    inside, outside = (w.both(f"({level} > {k})", entry) for entry in (inside, outside))
                self._outside.append((outside, w.sub(self.value, w.div(delta, OFFSET))))
                defined = w.holds(w.both(defined, inside) if defined else inside)
                self.reached = w.add(self.reached, w.pick(defined, 1.0, 0.0))
            for leaf in self._leaves:
                leaf.refine(k, defined)
            self.value = w.let(self._join(self._root)[0])

    def outside_bands(self) -> Number:
        """Return the field where all levels are defined, and elsewhere the distance to the band's offset surface."""
        value = self.value
        for outside, distance in reversed(self._outside):
            value = self._w.let(self._w.pick(outside, distance, value))
        return value

    def gradient(self) -> Triple:
        """Return the gradient of the field."""
        return self._weighed([(share, leaf.gradient(share)) for share, leaf in self._shares()])

    def colour(self, plain: tuple[float, float, float]) -> Triple:
        """Return the colour, sRGB. plain: of shapes without a texture."""
        sizes = [(self._w.let(self._w.call("abs", share)), leaf) for share, leaf in self._shares()]
        return self._weighed([(size, leaf.colour(size, plain)) for size, leaf in sizes])

    def lines(self, *results: Number) -> list[str]:
        """Return the lines that compute some numbers."""
        return self._w.lines(*results)

    def text(self, value: Number) -> str:
        """Return a number as text."""
        return self._w.text(value)

    def _shares(self) -> list[tuple[Number, LeafAtPoint]]:
        """Return the leaves, each with its share in the field."""
        _, shares = self._join(self._root, shares=True)
        return [(shares[i], leaf) for i, leaf in enumerate(self._leaves)]

    def _weighed(self, parts: list[tuple[Number, Triple]]) -> Triple:
        """Return the sum of vectors, each times its share."""
        w, sums = self._w, list[Number]([0.0, 0.0, 0.0])
        for share, vector in parts:
            sums = [w.let(w.add(a, w.mul(share, b))) for a, b in zip(sums, vector, strict=True)]
        return sums[0], sums[1], sums[2]

    def _join(self, node: Join | int, shares: bool = False) -> tuple[Number, dict[int, Number]]:
        """Return the value of a node, and the shares of its leaves in it, where they are asked for."""
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
                # The first stays where both are equal.
                other = w.let(w.pick(w.less(second, first), 1.0, 0.0)) if shares else 0.0
                share = w.let(w.sub(1.0, other))
            if shares:
                kept = {i: w.let(w.mul(share, weight)) for i, weight in kept.items()}
                kept |= {i: w.let(w.mul(w.mul(sign, other), weight)) for i, weight in own.items()}
            total = w.let(joined)
        return total, kept
