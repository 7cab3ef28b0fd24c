"""A scene's field as GLSL with loops over tables (ir/composition.py), for weights in a texture."""

from collections.abc import Iterator
from itertools import accumulate

from ... import glsl
from ...ir.composition import Join, Leaf
from ...ir.program import Program
from ...model.expression import Expression, number
from ...model.model import DELTA_FACTOR
from ...model.scene import DIFFERENCE, SMOOTH_UNION, UNION, Disc, Placement
from .cstyle import Language
from .networks import Networks
from .texels import TexelLayout


class SceneLoops:
    """Prints the functions of `print_field` for a scene. plain: color, sRGB, of shapes without a texture."""

    def __init__(self, program: Program, language: Language, layout: TexelLayout, plain: str) -> None:
        assert program.composition is not None
        self._leaves = program.composition.leaves
        self._root = program.composition.root
        self._count = len(self._leaves)
        self._levels = len(program.bands)
        self._language = language
        self._plain = plain
        self._networks = Networks(program, language, layout)

    def lines(self) -> Iterator[str]:
        """Yield all lines: networks, tables, helpers, field(), field_gradient() and albedo()."""
        yield from self._networks.lines()
        yield from (
            "",
            f"const float FADE = {self._number(DELTA_FACTOR / (DELTA_FACTOR - 1))};",
            "",
            *_lines("scene.glsl"),
        )
        if any(isinstance(leaf.part, Disc) for leaf in self._leaves):
            yield from ("", *_lines("disk_distance.glsl"))
        yield from self._tables()
        for i, leaf in enumerate(self._leaves):
            yield from self._place(i, leaf)
        yield from self._joined(shares=False)
        yield from self._joined(shares=True)
        yield from self._composed()
        yield from self._field_gradient()
        yield from self._albedo()

    def loops(self) -> tuple[tuple[int, ...], tuple[int, ...], int]:
        """Return upper bounds of the loop iterations: field() and field_gradient() at each level, albedo()."""
        value, gradient = [0] * self._levels, [0] * self._levels
        texture = 0
        for leaf in self._leaves:
            if isinstance(leaf.part, Disc):
                continue
            for i, function in enumerate(leaf.part.values[: self._levels]):
                value[i] += self._networks.loops(function)
                gradient[i] += 3 * self._networks.loops(function)
            texture += 0 if leaf.part.texture is None else self._networks.loops(leaf.part.texture)
        around = self._count + 3
        values = tuple(accumulate(loops + around for loops in value))
        gradients = tuple(a + b + around for a, b in zip(values, accumulate(gradient), strict=True))
        return values, gradients, values[-1] + texture + around

    def _tables(self) -> Iterator[str]:
        """Yield the tables of the leaves: networks, bands, textures, and colors without a texture."""
        n, levels = self._count, self._levels
        networks, bands, textures, tints = [], [], [], []
        for leaf in self._leaves:
            part = leaf.part
            if isinstance(part, Disc):
                networks += ["-1"] * levels
                bands += ["0."] * levels
                textures.append("-1")
                tints.append(f"vec3({', '.join(map(self._number, part.color))})")
                continue
            of_levels = [self._networks.index(function) for function in part.values[:levels]]
            networks += [str(index) for index in of_levels] + ["-1"] * (levels - len(of_levels))
            deltas = [band.delta for band in part.bands[:levels]]
            bands += [self._number(delta) for delta in deltas] + ["0."] * (levels - len(deltas))
            textures.append("-1" if part.texture is None else str(self._networks.index(part.texture)))
            tints.append(f"vec3({self._plain})")
        yield from ("", "// Of each shape: its networks, level by level, and their bands; its texture, or its color.")
        for kind, name, values in (
            ("int", "network_of", networks),
            ("float", "band_of", bands),
            ("int", "texture_of", textures),
            ("vec3", "tint_of", tints),
        ):
            yield f"const {kind} {name}[{len(values)}] = {kind}[]({', '.join(values)});"
        yield f"const int SHAPES = {n};"

    def _place(self, i: int, leaf: Leaf[Program]) -> Iterator[str]:
        """Yield place{i}(): the point in a leaf's space, and the leaf's scale."""
        yield from ("", f"vec4 place{i}(vec3 p) {{", "    float s = 1.;")
        for place in leaf.places:
            if any(value != number(0) for value in place.translate):
                yield f"    p -= vec3({', '.join(map(self._text, place.translate))});"
            if place.angle != number(0):
                yield f"    p = {self._rotated('p', place, back=True)};"
            if place.scale != number(1):
                yield from (f"    p /= {self._text(place.scale)};", f"    s *= {self._text(place.scale)};")
        yield from ("    return vec4(p, s);", "}")

    def _at_point(self) -> Iterator[str]:
        """Yield the lines that compute for each leaf the point, the fourth input, and the evaluation distance."""
        yield "    vec4 q[SHAPES];"
        yield "    float when[SHAPES], most[SHAPES];"
        for i, leaf in enumerate(self._leaves):
            moving = isinstance(leaf.part, Program) and leaf.part.moving
            most = f"1. + {self._text(leaf.margin)}" if isinstance(leaf.part, Program) else "-1."
            yield f"    q[{i}] = place{i}(p);"
            yield f"    when[{i}] = {self._text(leaf.time) if moving else '1.'};"
            yield f"    most[{i}] = {most};"

    def _composed(self) -> Iterator[str]:
        """Yield composed(), which computes the field and every leaf's value, and field()."""
        yield from ("", "float composed(vec3 p, int level, out int reached, out float d[SHAPES]) {")
        yield from self._at_point()
        yield from """    float v[SHAPES];
    bool here[SHAPES];
    for (int i = 0; i < SHAPES; ++i) {
        float far = length(q[i].xyz);
        here[i] = far < most[i];
        v[i] = 0.;
        d[i] = q[i].w * (far - 1.);
    }""".splitlines()
        for i, leaf in enumerate(self._leaves):
            if isinstance(leaf.part, Disc):
                yield f"    d[{i}] = q[{i}].w * disk_distance(q[{i}].xyz, {self._plate(leaf.part)}).w;"
        yield from """    float f = 0.;
    for (int k = 0; k < level; ++k) {
        if (k > 0 && abs(f) >= delta[k - 1]) break;
        for (int i = 0; i < SHAPES; ++i) {
            int at = LEVELS * i + k;
            if (network_of[at] < 0) continue;
            float share = 1.;
            if (k > 0) {
                here[i] = here[i] && abs(v[i]) < band_of[at - 1];
                share = faded(v[i], band_of[at - 1]);
            }
            float far = length(q[i].xyz);
            // Loops that end after one turn, where branches would do: what no ray asks, software drivers skip then.
            for (bool ask = here[i]; ask; ask = false) {
                v[i] += share * network(vec4(q[i].xyz / max(far, 1.), when[i]), network_of[at]).x;
                d[i] = q[i].w * bounded(v[i], far);
            }
        }
        f = joined(d);
        reached = k + 1;
    }
    return f;
}

float field(vec3 p, int level, out int reached) {
    float d[SHAPES];
    return composed(p, level, reached, d);
}""".splitlines()

    def _field_gradient(self) -> Iterator[str]:
        yield from ("", "vec4 field_gradient(vec3 p, int level) {")
        yield from self._at_point()
        yield from """    float d[SHAPES], w[SHAPES];
    int reached;
    float value = composed(p, level, reached, d);
    shares(d, w);
    vec3 slope[SHAPES];
    for (int i = 0; i < SHAPES; ++i) {
        float far = length(q[i].xyz);
        slope[i] = q[i].xyz / max(far, 1e-12);
        vec4 f = vec4(0);
        for (int k = 0; k < (w[i] == 0. || far >= most[i] ? 0 : reached); ++k) {
            int at = LEVELS * i + k;
            if (network_of[at] < 0 || k > 0 && abs(f.w) >= band_of[at - 1]) break;
            vec4 r = network_gradient(vec4(q[i].xyz / max(far, 1.), when[i]), network_of[at]);
            f = k == 0 ? r : refined(f, r, band_of[at - 1]);
        }
        if (far < most[i]) slope[i] = bounded_slope(f, slope[i], far);
    }
    vec3 g = vec3(0), s;""".splitlines()
        for i, leaf in enumerate(self._leaves):
            yield f"    s = slope[{i}];"
            if isinstance(leaf.part, Disc):
                yield f"    s = disk_distance(q[{i}].xyz, {self._plate(leaf.part)}).xyz;"
            for place in reversed(leaf.places):
                if place.angle != number(0):
                    yield f"    s = {self._rotated('s', place, back=False)};"
            yield f"    g += w[{i}] * s;"
        yield from ("    return vec4(g, value);", "}")

    def _albedo(self) -> Iterator[str]:
        yield from ("", "vec3 albedo(vec3 p) {")
        yield from self._at_point()
        yield from """    float d[SHAPES], w[SHAPES];
    int reached;
    composed(p, LEVELS, reached, d);
    shares(d, w);
    vec3 color = vec3(0);
    for (int i = 0; i < SHAPES; ++i) {
        vec3 own = tint_of[i];
        for (bool ask = w[i] != 0. && texture_of[i] >= 0; ask; ask = false) {
            vec4 z = vec4(q[i].xyz / max(length(q[i].xyz), 1.), when[i]);
            own = clamp(network(z, texture_of[i]).xyz, 0., 1.);
        }
        color += abs(w[i]) * own;
    }
    return color;
}""".splitlines()

    def _joined(self, shares: bool) -> Iterator[str]:
        """Yield joined(), which joins the leaves' values, or shares(), the leaves' shares in the result."""
        head = "void shares(float d[SHAPES], out float w[SHAPES])" if shares else "float joined(float d[SHAPES])"
        yield from ("", head + " {")
        self._variables = 0
        lines: list[str] = []
        result, _ = self._join(self._root, lines, shares)
        yield from (f"    {line}" for line in lines)
        yield from () if shares else (f"    return {result};",)
        yield "}"

    def _join(self, node: Join | int, lines: list[str], shares: bool) -> tuple[str, list[int]]:
        """Append the lines that compute a node. Return the variable of its value, and its leaves."""
        if not isinstance(node, Join):
            lines += [f"w[{node}] = 1.;"] if shares else []
            return f"d[{node}]", [node]
        total, leaves = self._join(node.parts[0], lines, shares)
        for part in node.parts[1:]:
            value, own = self._join(part, lines, shares)
            name = f"a{self._variables}"
            self._variables += 1
            sign = "-" if node.operation == DIFFERENCE else ""
            if node.operation == SMOOTH_UNION:
                radius = self._text(node.radius)
                lines.append(f"float h{name} = clamp(.5 + .5 * ({value} - {total}) / {radius}, 0., 1.);")
                blend = f"mix({value}, {total}, h{name}) - {radius} * h{name} * (1. - h{name})"
                lines.append(f"float {name} = {blend};")
            else:
                order, pick = ("<=", "min") if node.operation == UNION else (">=", "max")
                if shares:
                    lines.append(f"float h{name} = {total} {order} {sign}{value} ? 1. : 0.;")
                lines.append(f"float {name} = {pick}({total}, {sign}{value});")
            if shares:
                lines += [f"w[{i}] *= h{name};" for i in leaves]
                lines += [f"w[{i}] *= {'h' + name + ' - 1.' if sign else '1. - h' + name};" for i in own]
            total, leaves = name, leaves + own
        return total, leaves

    def _rotated(self, vector: str, place: Placement, back: bool) -> str:
        """Return a vector rotated to the surrounding space, or back."""
        radians = Expression("*", operands=(place.angle, number(0.017453292519943295)))
        cosine, sine = (self._text(Expression(kind, operands=(radians,))) for kind in ("cos", "sin"))
        axis = ", ".join(map(self._number, place.axis))
        return f"turned({vector}, vec3({axis}), {cosine}, {'-' if back else ''}({sine}))"

    def _plate(self, disc: Disc) -> str:
        return f"{self._number(disc.radius)}, {self._number(disc.thickness / 2)}"

    def _number(self, value: float) -> str:
        return self._language.number(value)

    def _text(self, expression: Expression) -> str:
        """Return an expression as text; a number where it does not move."""
        if not expression.moves:
            text = self._number(expression.at(0.0))
            return f"({text})" if text.startswith("-") else text
        operands = [self._text(operand) for operand in expression.operands]
        joined = f" {expression.kind} ".join(operands)
        printed = {
            "t": "time",
            "negative": f"(-{joined})",
            "**": f"({' * '.join(operands * int(expression.value)) or '1.'})",
            "sin": f"{self._language.sine}(vec4({joined})).x",
            "cos": f"{self._language.cosine}(vec4({joined})).x",
        } | {name: f"{name}({', '.join(operands)})" for name in ("abs", "min", "max")}
        return printed.get(expression.kind, f"({joined})")


def _lines(name: str) -> list[str]:
    """Return the lines of a file in glsl/."""
    return glsl.load(name).splitlines()
