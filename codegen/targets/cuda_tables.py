"""Tables of a CUDA file: constants of the model, uniforms, and shapes of the networks."""

from ...field.lowest import lowest_point
from ...ir.program import Affine, Dot, Function, Program
from ..printers.cstyle import Language
from .orbit import AZIMUTH, ELEVATION, FOV, MARGIN
from .uniforms import GROUND, LEVELS, SCHEDULES, SHADINGS, TIME, UNIFORMS, Uniform, default

LANGUAGE = Language(
    function="__device__ inline {type} {name}({parameters})",
    out="{type} &{name}",
    suffix="f",
    texel="as_vec4(__ldg(weights + {k}))",
)
"""CUDA C++, with the weights in an array of texels instead of a texture."""
FRAGMENT = 16
"""Columns of one mma.sync instruction; networks are padded to a multiple of it."""
WIDEST_SPLIT = 128
"""Largest width of a level 1 that is evaluated with every float as a sum of two halves (float16).

With level 1 rounded to single halves, its error would dominate the picture's (docs/cuda.md).
"""
PER_LEVEL = {"DELTAS": "delta", "STEP_BOUNDS": "step_bound", "BAND_STEP_BOUNDS": "band_step_bound"}
"""Constant array of floats -> attribute of `Band`."""
LACKING = ("origin", "jitter")
"""Uniforms without a CUDA counterpart: CUDA draws whole pictures, one ray through the center of each pixel."""


def model_constants(program: Program) -> list[str]:
    """Return the declarations of the model's compile-time constants, without weights."""
    textured = int(program.colored)
    depths = [len(_affines(function)) for function in _functions(program).values()]
    return [
        f"const char *const MODEL = {c_string(program.name)};",
        f"const char *const SHA256 = {c_string(program.sha256)};",
        f"constexpr int LEVELS = {len(program.bands)};",
        f"constexpr float GROUND = {LANGUAGE.number(round(lowest_point(program), 4))};  // of the shape's lowest point",
        *([f"constexpr int MOST_LAYERS = {max(depths)};"] if depths else []),
        f"constexpr bool MOVING = {str(program.moving).lower()};  // a field of (x, y, z, t)",
        f"#define TEXTURED {textured}",
        f"constexpr int ITERATIONS[LEVELS] = {{{', '.join(str(band.iterations) for band in program.bands)}}};",
        *(
            f"constexpr float {constant}[LEVELS] = "
            f"{{{', '.join(LANGUAGE.number(getattr(band, name)) for band in program.bands)}}};"
            for constant, name in PER_LEVEL.items()
        ),
    ]


def uniforms() -> list[str]:
    """Return the declarations of the uniforms and of the orbit camera's numbers."""
    return [
        "// The uniforms of the GLSL targets, with their defaults.",
        "struct Uniforms {",
        *(
            f"    {uniform.type} {uniform.name} = {_default(uniform)};  // {uniform.meaning}"
            for uniform in UNIFORMS
            if not uniform.per_level and uniform.name not in LACKING
        ),
        "};",
        *(
            f"__constant__ {uniform.type} {uniform.declared};  // {uniform.meaning}"
            for uniform in (*UNIFORMS, TIME)
            if uniform.per_level or uniform is TIME
        ),
        f"constexpr float DEFAULT_TIME = {LANGUAGE.number(default('time')[0])};",
        "// Names of the shadings and of the schedules; the index is the uniform's value.",
        f"const char *const SHADINGS[] = {{{', '.join(map(c_string, SHADINGS))}}};",
        f"const char *const SCHEDULES[] = {{{', '.join(map(c_string, SCHEDULES))}}};",
        "// Defaults of --camera and --fov.",
        f"constexpr double AZIMUTH = {AZIMUTH!r}, ELEVATION = {ELEVATION!r}, FOV = {FOV!r};  // degrees",
        f"constexpr double MARGIN = {MARGIN!r};  // the picture shows a sphere of this radius",
    ]


def _default(uniform: Uniform) -> str:
    """Return a uniform's default as a C++ expression."""
    if uniform.default in (GROUND, LEVELS):
        return str(uniform.default)
    numbers = default(uniform.name)
    if uniform.type == "int":
        return str(int(numbers[0]))
    texts = [LANGUAGE.number(number) for number in numbers]
    if uniform.type == "float":
        return texts[0]
    if uniform.type == "mat4":
        texts = [f"vec4({', '.join(texts[i : i + 4])})" for i in range(0, len(texts), 4)]
    return f"{uniform.type}({', '.join(texts)})"


def _functions(program: Program) -> dict[int, Function]:
    """Return the functions of the networks by their index in NETWORKS: levels from 1; 0 for the texture."""
    texture = {} if program.texture is None else {0: program.texture}
    return texture | dict(enumerate(program.values, start=1))


def _affines(function: Function) -> list[Affine]:
    return [op for op in function.ops if isinstance(op, Affine)]


def _dots(function: Function) -> list[Dot]:
    return [op for op in function.ops if isinstance(op, Dot)]


def networks(program: Program, offsets: dict[str, int]) -> list[str]:
    """Return the networks' shapes: as types NetworkOf<level>, and as the table NETWORKS of networks.cuh.

    offsets: constant -> index of its first texel in WEIGHTS.
    """
    rows = []
    types = [
        "// A level's network at compile time, index: level; 0: the texture.",
        "template <int LEVEL> struct NetworkOf;",
    ]
    for i in range(len(program.bands) + 1):
        function = _functions(program).get(i)
        if function is None:
            rows.append("    {},")
            continue
        affines, dots = _affines(function), _dots(function)
        widest = max(int(program.constants[op.matrix].shape[0]) for op in affines)
        width = -(-widest // FRAGMENT) * FRAGMENT
        layers = ", ".join(_layer(program, op, offsets) for op in affines)
        output_rows = ", ".join(str(offsets[op.row]) for op in dots)
        rows.append(
            f"    {{{width}, {len(affines)}, {len(dots)}, {{{layers}}}, {{{output_rows}}}, "
            f"{program.cost(function).multiply_adds}}},"
        )
        types += [
            f"template <> struct NetworkOf<{i}> {{",
            f"    static constexpr int WIDTH = {width}, LAYERS = {len(affines)}, OUTPUTS = {len(dots)};",
            f"    static constexpr bool SPLIT = {str(i == 1 and width <= WIDEST_SPLIT).lower()};",
            _by_index("scale", [op.scale for op in dots]),
            _by_index("offset", [op.bias for op in dots]),
            "};",
        ]
    return [*types, f"const Network NETWORKS[{len(rows)}] = {{", *rows, "};"]


def _layer(program: Program, op: Affine, offsets: dict[str, int]) -> str:
    """Return a hidden layer as a Layer of networks.cuh."""
    rows, columns = program.constants[op.matrix].shape
    return f"{{{rows}, {columns}, {offsets[op.matrix]}, {-1 if op.bias is None else offsets[op.bias]}}}"


def _by_index(name: str, values: list[float]) -> str:
    """Return a constexpr member function that returns values[c]."""
    texts = [LANGUAGE.number(value) for value in values]
    choice = texts[-1]
    for c in range(len(texts) - 2, -1, -1):
        choice = f"c == {c} ? {texts[c]} : {choice}"
    parameter = "int c" if len(texts) > 1 else "int"
    return f"    __device__ static constexpr float {name}({parameter}) {{ return {choice}; }}"


def c_string(text: str) -> str:
    """Return a C++ string literal of any text: all but ASCII letters, digits and spaces are octal escapes."""
    plain = (
        chr(byte) if (chr(byte).isalnum() and byte < 128) or byte == 32 else f"\\{byte:03o}"
        for byte in text.encode(errors="backslashreplace")
    )
    return f'"{"".join(plain)}"'
