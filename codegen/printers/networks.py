"""Prints a scene's networks as data: one GLSL function evaluates any of them, and one its gradient.

Software drivers would compile a function for every network of every shape for minutes. Here loops read the networks'
sizes from tables, and their weights from the texture (texels.py).
"""

from collections.abc import Iterator

from ...ir.lower_scene import PADDED
from ...ir.program import Affine, Dot, Function, Program
from .cstyle import Language
from .texels import TexelLayout

AT_ONCE = PADDED // 4
"""Blocks of rows and of columns in one iteration of a loop."""


class Networks:
    """The networks of a scene's program: its functions but the gradients, by index."""

    def __init__(self, program: Program, language: Language, layout: TexelLayout) -> None:
        self._program, self._language, self._layout = program, language, layout
        gradients = {function.name for part in _parts(program) for function in part.gradients}
        self._functions = [function for function in program.functions() if function.name not in gradients]
        self._numbers = {function.name: i for i, function in enumerate(self._functions)}
        rows = [self._blocks(op)[0] for function in self._functions for op in self._affines(function)]
        if any(count % AT_ONCE for count in rows):
            raise ValueError(f"hidden layers are not a multiple of {4 * AT_ONCE} wide")
        self._widest = max(rows)
        self._deepest = max(len(self._affines(function)) for function in self._functions)

    def index(self, function: Function) -> int:
        """Return the index of a network."""
        return self._numbers[function.name]

    def loops(self, function: Function) -> int:
        """Return an upper bound of the loop iterations of one value."""
        affines = self._affines(function)
        blocks = [tuple(count // AT_ONCE for count in self._blocks(op)) for op in affines]
        return 4 + blocks[-1][0] + sum(rows * (columns + 2) + 2 for rows, columns in blocks)

    def lines(self) -> Iterator[str]:
        """Yield the tables and the two functions.

        vec4 network(vec4 z, int n): the outputs of network n, at most three, for the input z.
        vec4 network_gradient(vec4 z, int n): gradient of the first output along x, y and z, and that output.
        """
        layers: list[tuple[int, ...]] = []
        networks: list[tuple[int, ...]] = []
        outputs: list[tuple[float, float]] = []
        for function in self._functions:
            affines = self._affines(function)
            dots = [op for op in function.ops if isinstance(op, Dot)]
            networks.append((len(layers), len(affines), self._layout.offsets[dots[0].row], len(outputs)))
            outputs += [(op.scale, op.bias) for op in dots] + [(0.0, 0.0)] * (3 - len(dots))
            for op in affines:
                rows, columns = self._blocks(op)
                bias = -1 if op.bias is None else self._layout.offsets[op.bias]
                layers.append((self._layout.offsets[op.matrix], bias, rows, columns))
        number = self._language.number
        yield from (
            "",
            "// Layers: the texels of their matrix and bias, and the blocks of four that they give and take.",
        )
        yield from self._table("ivec4", "LAYERS", [", ".join(map(str, layer)) for layer in layers])
        yield "// Networks: their first layer, their layers, the rows of their outputs, and the first of OUTPUTS."
        yield from self._table("ivec4", "NETWORKS", [", ".join(map(str, network)) for network in networks])
        yield from self._table("vec2", "OUTPUTS", [f"{number(scale)}, {number(bias)}" for scale, bias in outputs])
        yield f"const int WIDEST = {self._widest}, AT_ONCE = {AT_ONCE};"
        sine, cosine = self._language.sine, self._language.cosine
        yield from ("", "vec4 network(vec4 z, int n) {", "    ivec4 net = NETWORKS[n];", "    vec4 x[2 * WIDEST];")
        yield from self._forward([f"x[to + o + {{u}}] = {sine}(s{{u}});"])
        yield from """    vec4 r = vec4(0);
    int blocks = LAYERS[net.x + net.y - 1].z, last = WIDEST * (net.y & 1);
    for (int o = 0; o < blocks; ++o) {
        vec4 h = x[last + o];
        int k = net.z + o;
        r.xyz += vec3(dot(texel(k), h), dot(texel(k + blocks), h), dot(texel(k + 2 * blocks), h));
    }
    vec2 a = OUTPUTS[net.w], b = OUTPUTS[net.w + 1], c = OUTPUTS[net.w + 2];
    return vec4(vec3(a.x, b.x, c.x) * r.xyz + vec3(a.y, b.y, c.y), 0.);
}

vec4 network_gradient(vec4 z, int n) {
    ivec4 net = NETWORKS[n];""".splitlines()
        yield f"    vec4 x[2 * WIDEST], cosines[{self._deepest} * WIDEST];"
        yield from self._forward(
            [f"x[to + o + {{u}}] = {sine}(s{{u}});", f"cosines[WIDEST * l + o + {{u}}] = {cosine}(s{{u}});"]
        )
        yield from """    float f = 0.;
    int rows = LAYERS[net.x + net.y - 1].z, last = WIDEST * (net.y & 1);
    vec2 scaled = OUTPUTS[net.w];
    for (int o = 0; o < rows; ++o) {
        vec4 row = texel(net.z + o);
        f += dot(row, x[last + o]);
        x[o] = scaled.x * row * cosines[WIDEST * (net.y - 1) + o];
    }
    int from = 0;
    for (int l = net.y - 1; l > 0; --l) {
        ivec4 layer = LAYERS[net.x + l];
        int to = WIDEST - from;
        for (int i = 0; i < layer.w; i += AT_ONCE) {""".splitlines()
        yield "            vec4 " + ", ".join(f"s{v} = vec4(0)" for v in range(AT_ONCE)) + ";"
        yield "            for (int o = 0; o < layer.z; o += AT_ONCE) {"
        yield "                int k = layer.x + 4 * (layer.w * o + i);"
        for u in range(AT_ONCE):
            yield f"                vec4 e{u} = x[from + o + {u}];"
        for v in range(AT_ONCE):
            for u in range(AT_ONCE):
                yield f"                s{v} += e{u} * block(k + 4 * ({u} * layer.w + {v}));"
        yield "            }"
        yield from (
            f"            x[to + i + {v}] = s{v} * cosines[WIDEST * (l - 1) + i + {v}];" for v in range(AT_ONCE)
        )
        yield from """        }
        from = to;
    }
    ivec4 first = LAYERS[net.x];
    vec4 g = vec4(0);
    for (int o = 0; o < first.z; ++o) g += x[from + o] * block(first.x + 4 * o);
    return vec4(g.xyz, scaled.x * f + scaled.y);
}""".splitlines()

    def _forward(self, results: list[str]) -> Iterator[str]:
        """Yield the loop over all layers. The last layer's results are at WIDEST * (its number & 1)."""
        blocks = range(AT_ONCE)
        yield "    for (int l = 0; l < net.y; ++l) {"
        yield "        ivec4 layer = LAYERS[net.x + l];"
        yield "        int to = WIDEST * (l + 1 & 1), from = WIDEST - to, columns = l == 0 ? 0 : layer.w;"
        yield "        for (int o = 0; o < layer.z; o += AT_ONCE) {"
        for u in blocks:
            yield f"            vec4 s{u} = layer.y < 0 ? vec4(0) : texel(layer.y + o + {u});"
        yield "            if (l == 0) {"
        yield from (f"                s{u} += block(layer.x + 4 * (o + {u})) * z;" for u in blocks)
        yield "            }"
        yield "            for (int i = 0; i < columns; i += AT_ONCE) {"
        yield "                int k = layer.x + 4 * (layer.w * o + i);"
        yield from (f"                vec4 h{v} = x[from + i + {v}];" for v in blocks)
        for u in blocks:
            for v in blocks:
                yield f"                s{u} += block(k + 4 * ({u} * layer.w + {v})) * h{v};"
        yield "            }"
        for result in results:
            yield from (f"            {result.format(u=u)}" for u in blocks)
        yield from ("        }", "    }")

    def _table(self, kind: str, name: str, rows: list[str]) -> Iterator[str]:
        yield f"const {kind} {name}[{len(rows)}] = {kind}[]({', '.join(f'{kind}({row})' for row in rows)});"

    def _affines(self, function: Function) -> list[Affine]:
        return [op for op in function.ops if isinstance(op, Affine)]

    def _blocks(self, op: Affine) -> tuple[int, int]:
        rows, columns = self._program.constants[op.matrix].shape
        return rows // 4, columns // 4


def _parts(program: Program) -> tuple[Program, ...]:
    assert program.composition is not None
    return program.composition.programs
