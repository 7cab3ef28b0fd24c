"""Target cuda: one CUDA C++ file, a program that renders, checks and benchmarks (docs/cuda.md).

The field is printed as for every C-like target, camera, march and shading are the functions in glsl/ printed as CUDA,
and the kernels around them are written by hand, in cuda_source/.
"""

import re
from importlib.resources import files

from ... import glsl
from ...model.errors import UserError
from ...model.model import Model
from ..ir.lower import lower
from ..ir.program import Affine, Dot, Function, Program
from ..printers.cstyle import Language
from ..printers.field import print_field
from ..printers.glsl_as_cuda import glsl_as_cuda
from ..reference.lowest import lowest_point
from .cuda_cells import print_cells
from .cuda_scene import scene_field
from .header import header_facts, header_line
from .orbit import AZIMUTH, ELEVATION, FOV, MARGIN
from .uniforms import GROUND, LEVELS, SCHEDULES, SHADINGS, TIME, UNIFORMS, Uniform, default

LANGUAGE = Language(
    function="__device__ inline {type} {name}({parameters})",
    out="int &{name}",
    suffix="f",
    texel="as_vec4(__ldg(weights + {k}))",
)
"""CUDA C++; its weights are an array of texels, not a texture."""
FRAGMENT = 16
"""Columns that the instruction mma.sync takes at a time; networks are padded to a multiple of it."""
WIDEST_SPLIT = 128
"""Up to this width, level 1 is evaluated with every float as a sum of two halves (float16).

Its rounding to single halves would be the whole error of a picture (docs/cuda.md).
"""
PER_LEVEL = {"DELTAS": "delta", "STEP_BOUNDS": "step_bound", "BAND_STEP_BOUNDS": "band_step_bound"}
"""Name of a constant array of floats -> the number of a Band that it holds for each level."""
LACKING = ("origin", "jitter")
"""Uniforms that CUDA lacks: it draws whole pictures, one ray through the centre of each pixel."""
READ_BY_GLSL = (
    *("field", "iterations", "delta", "step_bound", "band_step_bound"),
    *("skip", "cell_code", "cells_hold", "cell_count", "cells_half"),
)
"""What functions in glsl/ use without declaring it: the generated field, the uniforms with an entry per level, and the
grid of cells (cuda_source/grid.cuh)."""

HEADERS = (
    "cuda_runtime.h",
    "dlfcn.h",
    "algorithm",
    "cerrno",
    "cmath",
    "cstdarg",
    "cstdio",
    "cstdlib",
    "cstring",
    "list",
    "map",
    "memory",
    "set",
    "sstream",
    "string",
    "type_traits",
    "utility",
    "vector",
)
"""What the file includes: the toolkit's own, and the standard library's."""


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """Return the text of the CUDA file that draws `model`.

    storage: "auto" or "texture", which mean the same: the weights are one array, which every variant lays out as it
    needs; digits: decimals that the weights are rounded to, None for all. Raises UserError for any other storage.
    """
    if storage not in ("auto", "texture"):
        raise UserError(f"--storage {storage}: cuda keeps its weights in one array; leave --storage out")
    program = lower(model, digits, padded=False)
    if program.composition is None:
        printed = print_field(program, LANGUAGE, "texture")
        field, layout = printed.text, printed.layout
    else:
        field, layout = scene_field(program, LANGUAGE)
    texels = layout.texels
    seen: set[str] = set()
    return "\n".join(
        [
            *_head(model, program),
            "",
            *(f"#include <{header}>" for header in HEADERS),
            "",
            "namespace mplicits {",
            "",
            *_model_constants(program),
            *print_cells(program, LANGUAGE),
            "",
            f"const float WEIGHTS[{len(texels)}][4] = {{",
            *(f"    {{{', '.join(LANGUAGE.number(value) for value in texel)}}}," for texel in texels),
            "};",
            f"__device__ float4 weights[{len(texels)}];",
            "",
            _load("check.cuh", seen) + _load("vectors.cuh", seen),
            *_uniforms(),
            "",
            _load("settings.cuh", seen),
            "// The field, as every target has it: p in model space, levels counted from 1.",
            "__device__ inline vec4 as_vec4(float4 v) { return vec4(v.x, v.y, v.z, v.w); }",
            field,
            *_many_rays(program, layout.offsets, seen),
            _load("main.cuh", seen),
            "}  // namespace mplicits",
            "",
            "int main(int count, char **values) { return mplicits::run(count, values); }",
            "",
        ]
    )


def _many_rays(program: Program, offsets: dict[str, int], seen: set[str]) -> list[str]:
    """Return what the variants read that evaluate a network for many rays at once; of a scene, what stands for them.

    offsets, seen: as of `_networks` and `_load`.
    """
    if program.composition is None:
        return [_load("networks.cuh", seen), *_networks(program, offsets), ""]
    seen |= {"frames.cuh", "benchmark.cuh"}
    return [_load("scene.cuh", seen), ""]


def _load(name: str, seen: set[str]) -> str:
    """Return the text of a file in cuda_source/ or, printed as CUDA, in glsl/, with the files that it includes.

    `#include "other"` is replaced by that file once in the whole output, and by nothing after that. seen: names of the
    files that the output holds, which this call adds to.
    """
    if name in seen:
        return ""
    if name.endswith(".glsl"):
        return glsl_as_cuda(_with_includes(name, glsl.read(name), seen), READ_BY_GLSL)
    text = files(__package__).joinpath("cuda_source", name).read_text(encoding="utf-8")
    return _with_includes(name, text, seen)


def _with_includes(name: str, text: str, seen: set[str]) -> str:
    """Return `text`, of the file `name`, with the files that it includes; those of a GLSL file stay GLSL."""
    seen.add(name)

    def include(match: re.Match[str]) -> str:
        if match[1] in seen or not name.endswith(".glsl"):
            return _load(match[1], seen)
        return _with_includes(match[1], glsl.read(match[1]), seen)

    return glsl.INCLUDE.sub(include, text)


def _head(model: Model, program: Program) -> list[str]:
    """Return the comment that the file begins with."""
    opening = [
        header_line(header_facts(model, program, "cuda")),
        "// Multiscale neural signed distance function.",
        "//",
        "//     nvcc -O3 -arch=native model.cu -o model && ./model --help",
        "//",
    ]
    if program.composition is not None:
        return [*opening, "// A scene: one variant, simple, with one thread per ray, float32."]
    return [
        *opening,
        "// Variants: simple, one thread per ray, float32; fused, tiles of rays on the tensor cores; layered, a",
        "// product by cuBLAS per layer, over all pixels. cuBLAS is part of the CUDA toolkit; it is opened at run time",
        "// by the variant that needs it: nothing is to be linked. In order: check, vectors, uniforms, camera_ray,",
        "// settings, the field, networks, shade, arguments, grid, cells, march, background, to_floor, key_light,",
        "// openness, studio, floor_colour, colours, simple, stepping, mma, packed, team, tile, adjoint, queues,",
        "// fused, cublas, layered, picture, unpack, benchmark, main. Of these, camera_ray, shade, cells, march,",
        "// background, and all from to_floor to floor_colour, are the functions of the GLSL targets.",
    ]


def _model_constants(program: Program) -> list[str]:
    """Return what the kernels know of the model at compile time, weights excepted, as declarations."""
    textured = int(program.coloured)
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


def _uniforms() -> list[str]:
    """Return the tables of uniforms and of the orbit camera's numbers as declarations."""
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
        "// The camera that --camera and --fov stand for where they are not given.",
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
    """Return the functions that evaluate networks, by their index in NETWORKS: levels from 1, 0 for the texture."""
    texture = {} if program.texture is None else {0: program.texture}
    return texture | dict(enumerate(program.values, start=1))


def _affines(function: Function) -> list[Affine]:
    """Return a network's hidden layers."""
    return [op for op in function.ops if isinstance(op, Affine)]


def _dots(function: Function) -> list[Dot]:
    """Return a network's output rows."""
    return [op for op in function.ops if isinstance(op, Dot)]


def _networks(program: Program, offsets: dict[str, int]) -> list[str]:
    """Return the networks' shapes: as types NetworkOf<level>, and as the table NETWORKS for networks.cuh.

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
            f"{_numbers(dots, 'scale')}, {_numbers(dots, 'bias')}, {program.cost(function).multiply_adds}}},"
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


def _numbers(dots: list[Dot], name: str) -> str:
    """Return one number of each output row, the attribute `name`, as an initialiser."""
    return f"{{{', '.join(LANGUAGE.number(getattr(op, name)) for op in dots)}}}"


def _by_index(name: str, values: list[float]) -> str:
    """Return a constexpr member function that gives values[c]."""
    texts = [LANGUAGE.number(value) for value in values]
    choice = texts[-1]
    for c in range(len(texts) - 2, -1, -1):
        choice = f"c == {c} ? {texts[c]} : {choice}"
    parameter = "int c" if len(texts) > 1 else "int"
    return f"    __device__ static constexpr float {name}({parameter}) {{ return {choice}; }}"


def c_string(text: str) -> str:
    """Return a C++ string literal of any text, where all but letters, digits and spaces are octal escapes."""
    plain = (
        chr(byte) if (chr(byte).isalnum() and byte < 128) or byte == 32 else f"\\{byte:03o}"
        for byte in text.encode(errors="backslashreplace")
    )
    return f'"{"".join(plain)}"'
