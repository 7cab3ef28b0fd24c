"""One shape of a scene at one point, as scalars: its distance level by level, its gradient and its color."""

from ...ir.composition import Leaf
from ...ir.program import Program
from ...model.expression import number
from ...model.model import DELTA_FACTOR
from ...model.scene import Disc
from .scalars import Number, Triple, Writer


class LeafAtPoint:
    """A leaf at one point."""

    def __init__(self, leaf: Leaf[Program], writer: Writer, point: Triple) -> None:
        """Transform a point from the scene's space to the leaf's."""
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
                point = self._rotated(point, place.axis, cosine, w.sub(0.0, sine))
            if place.scale != number(1):
                factor = w.let(w.expression(place.scale))
                x, y, z = (w.let(w.div(a, factor)) for a in point)
                point, self.scale = (x, y, z), w.let(w.mul(self.scale, factor))
        self.point = point
        self.values: list[Number] = []
        """The field inside the ball at each level so far, in the leaf's unit."""
        self.conditions: list[str] = []
        """For each level, the condition under which its network is evaluated."""
        if isinstance(leaf.part, Disc):
            *slope, value = _plate(w, leaf.part, point)
            self.slope, self.distance = slope, w.let(w.mul(self.scale, value))
            return
        self.far = w.let(w.call("sqrt", w.let(w.dot(point, point))))
        inside = w.let(w.call("max", self.far, 1.0))
        x, y, z = (w.let(w.div(a, inside)) for a in point)
        self.inputs = (x, y, z, w.expression(leaf.time) if leaf.part.moving else 1.0)
        self.near = w.let_condition(w.less(self.far, w.add(1.0, w.expression(leaf.margin))))

    def refine(self, level: int, defined: str | None) -> None:
        """Add a level, counted from 0, where the scene's condition `defined` is true and the shape has that level."""
        part, w = self.leaf.part, self._w
        if not isinstance(part, Program) or level >= len(part.values):
            return
        share: Number = 1.0
        if level == 0:
            self.conditions.append(self.near)
        else:
            delta, coarser = part.bands[level - 1].delta, self.values[-1]
            inside = w.less(w.call("abs", coarser), delta)
            here = w.both(self.conditions[-1], inside)
            self.conditions.append(w.let_condition(w.both(here, defined) if defined else here))
            share = w.let(_fade(w, coarser, delta))
        (residual,) = w.network(part.values[level], self.inputs, self.conditions[-1])
        self.values.append(w.let(w.add(self.values[-1] if level else 0.0, w.mul(share, residual))))
        outside, value = w.sub(self.far, 1.0), self.values[-1]
        out = w.let(w.call("max", outside, 0.0))
        positive = w.let(w.call("max", value, 0.0))
        beyond = w.call("sqrt", w.add(w.mul(out, out), w.mul(positive, positive)))
        bounded = w.pick(w.less(0.0, outside), beyond, value)
        self.distance = w.let(w.mul(self.scale, w.pick(self.near, bounded, outside)))

    def gradient(self, share: Number) -> Triple:
        """Return the distance's gradient in the scene's space. Where `share` is 0, no network is evaluated."""
        part, w = self.leaf.part, self._w
        if isinstance(part, Disc):
            x, y, z = self.slope
            return self._to_scene((x, y, z))
        counts = w.let_condition(w.less(0.0, w.call("abs", share)))
        gradient: Triple = 0.0, 0.0, 0.0
        for level, (function, condition) in enumerate(zip(part.gradients, self.conditions, strict=False)):
            *slope, residual = w.network(function, self.inputs, w.both(condition, counts))
            if level == 0:
                gradient = slope[0], slope[1], slope[2]
                continue
            coarser, delta = self.values[level - 1], part.bands[level - 1].delta
            fade = w.let(_fade(w, coarser, delta))
            steep = w.mul(w.div(residual, delta), DELTA_FACTOR / (DELTA_FACTOR - 1))
            falling = w.pick(w.less(coarser, 0.0), steep, w.sub(0.0, steep))
            kept = w.let(w.add(1.0, w.pick(w.less(fade, 1.0), falling, 0.0)))
            x, y, z = (w.let(w.add(w.mul(kept, a), w.mul(fade, b))) for a, b in zip(gradient, slope, strict=True))
            gradient = x, y, z
        # Outside the ball the distance is a hypotenuse, see ir/composition.py.
        far = w.let(w.call("max", self.far, 1e-12))
        x, y, z = (w.let(w.div(a, far)) for a in self.point)
        up: Triple = (x, y, z)
        outside, positive = w.let(w.sub(self.far, 1.0)), w.let(w.call("max", self.values[-1], 0.0))
        square = w.add(w.mul(outside, outside), w.mul(positive, positive))
        away = w.let(w.call("max", w.call("sqrt", square), 1e-12))
        upwards = w.let(w.dot(gradient, up))

        def component(g: Number, u: Number) -> Number:
            along = w.div(w.sub(g, w.mul(upwards, u)), far)
            beyond = w.div(w.add(w.mul(outside, u), w.mul(positive, along)), away)
            here = w.pick(w.less(0.0, outside), beyond, g)
            return w.let(w.pick(self.near, here, u))

        x, y, z = (component(g, u) for g, u in zip(gradient, up, strict=True))
        return self._to_scene((x, y, z))

    def color(self, share: Number, plain: tuple[float, float, float]) -> Triple:
        """Return the color; zeros where `share` is 0 and the shape has a texture. plain: color without a texture."""
        part, w = self.leaf.part, self._w
        if isinstance(part, Disc):
            return part.color
        if part.texture is None:
            return plain
        counts = w.less(0.0, w.call("abs", share))
        red, green, blue = (w.clamped(channel) for channel in w.network(part.texture, self.inputs, counts))
        return red, green, blue

    def _to_scene(self, vector: Triple) -> Triple:
        """Rotate a direction from the leaf's space to the scene's."""
        for axis, cosine, sine in reversed(self._turns):
            vector = self._rotated(vector, axis, cosine, sine)
        return vector

    def _rotated(self, v: Triple, axis: tuple[float, float, float], cosine: Number, sine: Number) -> Triple:
        """Rotate a vector about an axis of length 1 (Rodrigues)."""
        w = self._w
        along = w.let(w.mul(w.dot(v, axis), w.sub(1.0, cosine)))
        sine = w.let(sine)
        rotated: list[Number] = []
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            cross = w.sub(w.mul(v[j], axis[i]), w.mul(v[i], axis[j]))
            rotated.append(w.let(w.add(w.add(w.mul(cosine, v[k]), w.mul(sine, cross)), w.mul(along, axis[k]))))
        return rotated[0], rotated[1], rotated[2]


def _fade(w: Writer, f: Number, delta: float) -> Number:
    """Return fade(f) of ir/composition.py: the weight of the next level's residual where the field is f."""
    return w.clamped(w.mul(w.sub(delta, w.call("abs", f)), DELTA_FACTOR / (DELTA_FACTOR - 1) / delta))


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
