"""One shape of a scene at one point, as scalars: its distance, level after level, its gradient and its colour."""

from ...ir.composition import OFFSET, Leaf
from ...ir.program import Program
from ...model.expression import number
from ...model.scene import Disc
from .scalars import Number, Writer

Triple = tuple[Number, Number, Number]
"""A vector."""


class LeafAtPoint:
    """A leaf at the point."""

    def __init__(self, leaf: Leaf, writer: Writer, point: Triple) -> None:
        """Bring a point of the scene's space into the leaf's."""
        self.leaf, self._w = leaf, writer
        w = writer
        self.scale: Number = 1.0
        self._turns: list[tuple[tuple[float, float, float], Number, Number]] = []
        for place in leaf.places:
            x, y, z = (w.let(w.sub(a, w.expression(b))) for a, b in zip(point, place.translate, strict=True))
            point = x, y, z
            if place.angle != number(0):
                angle = w.let(w.mul(w.expression(place.angle), 0.017453292519943295))
                cosine, sine = w.let(w.call("cos", angle)), w.let(w.call("sin", angle))
                self._turns.append((place.axis, cosine, sine))
                point = self._turned(point, place.axis, cosine, w.sub(0.0, sine))
            if place.scale != number(1):
                factor = w.let(w.expression(place.scale))
                x, y, z = (w.let(w.div(a, factor)) for a in point)
                point, self.scale = (x, y, z), w.let(w.mul(self.scale, factor))
        self.point = point
        self.values: list[Number] = []
        """The field inside the ball at each level so far, in the leaf's unit."""
        self.conditions: list[str] = []
        """Where each level's network was asked."""
        if isinstance(leaf.part, Disc):
            *slope, value = _plate(w, leaf.part, point)
            self.slope, self.distance = slope, w.let(w.mul(self.scale, value))
            return
        self.far = w.let(w.call("sqrt", w.let(_dot(w, point, point))))
        inside = w.let(w.call("max", self.far, 1.0))
        x, y, z = (w.let(w.div(a, inside)) for a in point)
        self.inputs = (x, y, z, w.expression(leaf.time) if leaf.part.moving else 1.0)
        self.near = w.holds(w.less(self.far, w.add(1.0, w.expression(leaf.margin))))

    def refine(self, level: int, there: str | None) -> None:
        """Go to a level, counted from 0, where a condition holds and the shape has it."""
        part, w = self.leaf.part, self._w
        if not isinstance(part, Program) or level >= len(part.values):
            return
        share: Number = 1.0
        if level == 0:
            self.conditions.append(self.near)
        else:
            delta, before = part.bands[level - 1].delta, self.values[-1]
            inside = w.less(w.call("abs", before), delta)
            here = w.both(self.conditions[-1], inside)
            self.conditions.append(w.holds(w.both(here, there) if there else here))
            share = w.let(_faded(w, before, delta))
        (residual,) = w.ask(part.values[level], self.inputs, self.conditions[-1])
        self.values.append(w.let(w.add(self.values[-1] if level else 0.0, w.mul(share, residual))))
        outside, value = w.sub(self.far, 1.0), self.values[-1]
        out = w.let(w.call("max", outside, 0.0))
        positive = w.let(w.call("max", value, 0.0))
        beyond = w.call("sqrt", w.add(w.mul(out, out), w.mul(positive, positive)))
        bounded = w.pick(w.less(0.0, outside), beyond, value)
        self.distance = w.let(w.mul(self.scale, w.pick(self.near, bounded, outside)))

    def gradient(self, share: Number) -> Triple:
        """Return the gradient of the distance, where its share in the scene's is not zero, in the scene's space."""
        part, w = self.leaf.part, self._w
        if isinstance(part, Disc):
            x, y, z = self.slope
            return self._out((x, y, z))
        asked = w.holds(w.less(0.0, w.call("abs", share)))
        gradient: Triple = 0.0, 0.0, 0.0
        for level, (function, condition) in enumerate(zip(part.gradients, self.conditions, strict=False)):
            *slope, residual = w.ask(function, self.inputs, w.both(condition, asked))
            if level == 0:
                gradient = slope[0], slope[1], slope[2]
                continue
            before, delta = self.values[level - 1], part.bands[level - 1].delta
            fade = w.let(_faded(w, before, delta))
            steep = w.mul(w.div(residual, delta), OFFSET / (OFFSET - 1))
            falling = w.pick(w.less(before, 0.0), steep, w.sub(0.0, steep))
            kept = w.let(w.add(1.0, w.pick(w.less(fade, 1.0), falling, 0.0)))
            x, y, z = (w.let(w.add(w.mul(kept, a), w.mul(fade, b))) for a, b in zip(gradient, slope, strict=True))
            gradient = x, y, z
        # Outside the ball: of the hypotenuse, see composition.py.
        far = w.let(w.call("max", self.far, 1e-12))
        x, y, z = (w.let(w.div(a, far)) for a in self.point)
        up: Triple = (x, y, z)
        outside, positive = w.let(w.sub(self.far, 1.0)), w.let(w.call("max", self.values[-1], 0.0))
        square = w.add(w.mul(outside, outside), w.mul(positive, positive))
        away = w.let(w.call("max", w.call("sqrt", square), 1e-12))
        upwards = w.let(_dot(w, gradient, up))

        def slope_along(g: Number, u: Number) -> Number:
            along = w.div(w.sub(g, w.mul(upwards, u)), far)
            beyond = w.div(w.add(w.mul(outside, u), w.mul(positive, along)), away)
            here = w.pick(w.less(0.0, outside), beyond, g)
            return w.let(w.pick(self.near, here, u))

        x, y, z = (slope_along(g, u) for g, u in zip(gradient, up, strict=True))
        return self._out((x, y, z))

    def colour(self, share: Number, plain: tuple[float, float, float]) -> Triple:
        """Return the colour where its share is not zero. plain: of a shape without a texture."""
        part, w = self.leaf.part, self._w
        if isinstance(part, Disc):
            return part.colour
        if part.texture is None:
            return plain
        asked = w.less(0.0, w.call("abs", share))
        red, green, blue = (w.clamped(channel) for channel in w.ask(part.texture, self.inputs, asked))
        return red, green, blue

    def _out(self, vector: Triple) -> Triple:
        """Turn a direction of the leaf's space into the scene's."""
        for axis, cosine, sine in reversed(self._turns):
            vector = self._turned(vector, axis, cosine, sine)
        return vector

    def _turned(self, v: Triple, axis: tuple[float, float, float], cosine: Number, sine: Number) -> Triple:
        """Turn a vector about an axis of length 1 (Rodrigues)."""
        w = self._w
        along = w.let(w.mul(_dot(w, v, axis), w.sub(1.0, cosine)))
        sine = w.let(sine)
        turned: list[Number] = []
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            cross = w.sub(w.mul(v[j], axis[i]), w.mul(v[i], axis[j]))
            turned.append(w.let(w.add(w.add(w.mul(cosine, v[k]), w.mul(sine, cross)), w.mul(along, axis[k]))))
        return turned[0], turned[1], turned[2]


def _dot(w: Writer, a: Triple, b: "Triple | tuple[float, float, float]") -> Number:
    total: Number = 0.0
    for x, y in zip(a, b, strict=True):
        total = w.add(total, w.mul(x, y))
    return total


def _faded(w: Writer, f: Number, delta: float) -> Number:
    """Return the share of the next level's residual where the field is f, in a band of half width delta."""
    return w.clamped(w.mul(w.sub(delta, w.call("abs", f)), OFFSET / (OFFSET - 1) / delta))


def _plate(w: Writer, disc: Disc, point: Triple) -> tuple[Number, Number, Number, Number]:
    """Return the gradient of the distance to a plate, and the distance."""
    x, y, z = point
    half = disc.thickness / 2
    around = w.let(w.call("sqrt", w.add(w.mul(x, x), w.mul(z, z))))
    middle = w.let(w.add(y, half))
    beside = w.let(w.sub(around, disc.radius))
    above = w.let(w.sub(w.call("abs", middle), half))
    out, up = w.let(w.call("max", beside, 0.0)), w.let(w.call("max", above, 0.0))
    away = w.let(w.call("sqrt", w.add(w.mul(out, out), w.mul(up, up))))
    outside, tall = w.less(0.0, away), w.less(above, beside)
    length = w.let(w.call("max", away, 1e-12))
    by_side = w.let(w.pick(outside, w.div(out, length), w.pick(tall, 1.0, 0.0)))
    by_top = w.let(w.pick(outside, w.div(up, length), w.pick(tall, 0.0, 1.0)))
    rim = w.let(w.div(by_side, w.call("max", around, 1e-12)))
    value = w.add(w.call("min", w.call("max", beside, above), 0.0), away)
    top = w.pick(w.less(middle, 0.0), w.sub(0.0, by_top), by_top)
    return w.let(w.mul(rim, x)), w.let(top), w.let(w.mul(rim, z)), w.let(value)
