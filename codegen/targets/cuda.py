"""Target cuda: one CUDA C++ file, a program that renders, checks and benchmarks (docs/cuda.md).

The field is printed as for every C-like target. Camera, march and shading are functions of glsl/, printed as CUDA. The
kernels around them are hand-written, in cuda_source/.
"""

import re
from importlib.resources import files

from ... import glsl
from ...ir.lower import lower
from ...ir.program import Program
from ...model.errors import UserError
from ...model.model import Model
from ..printers.field import print_field
from ..printers.glsl_as_cuda import glsl_as_cuda
from .cuda_cells import print_cells
from .cuda_scene import scene_field
from .cuda_tables import LANGUAGE, model_constants, networks, uniforms
from .header import header_facts, header_line

READ_BY_GLSL = (
    *("field", "half_width", "iterations", "delta", "step_bound", "band_step_bound"),
    *("skip", "cell_code", "cells_hold", "cell_count", "cells_half", "NEAR"),
)
"""Names that functions in glsl/ use without a declaration: the field, half_width(), uniforms per level, and the grid of
cells (cuda_source/grid.cuh)."""

HEADERS = (
    "cuda_runtime.h",
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
"""Included headers: the toolkit's, and the standard library's."""


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """Return the text of the CUDA file that draws `model`.

    storage: "auto" or "texture", which mean the same: one array of weights. `fused` lays them out as it needs.
    digits: decimals of the weights; None for all. Raises UserError for any other storage.
    """
    if storage not in ("auto", "texture"):
        raise UserError(f"--storage {storage}: cuda keeps its weights in one array; leave the option out")
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
            *model_constants(program),
            *print_cells(program, LANGUAGE),
            "",
            f"const float WEIGHTS[{len(texels)}][4] = {{",
            *(f"    {{{', '.join(LANGUAGE.number(value) for value in texel)}}}," for texel in texels),
            "};",
            f"__device__ float4 weights[{len(texels)}];",
            "",
            _load("check.cuh", seen) + _load("vectors.cuh", seen),
            *uniforms(),
            "",
            _load("settings.cuh", seen),
            "// The field of all targets: p in model space, levels counted from 1.",
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
    """Return the networks' tables for the variant that evaluates many rays at once; a scene does not have it.

    offsets, seen: as of `networks` and `_load`.
    """
    if program.composition is None:
        return [_load("networks.cuh", seen), *networks(program, offsets), ""]
    seen |= {"frames.cuh", "benchmark.cuh"}
    return [_load("scene.cuh", seen), ""]


def _load(name: str, seen: set[str]) -> str:
    """Return the text of a file in cuda_source/ or, printed as CUDA, of glsl/, with the files that it includes.

    The first `#include "other"` in the whole output inserts that file; later ones insert nothing. seen: names of the
    files in the output; this call adds to it.
    """
    if name in seen:
        return ""
    if name.endswith(".glsl"):
        return glsl_as_cuda(_with_includes(name, glsl.read(name), seen), READ_BY_GLSL)
    text = files(__package__).joinpath("cuda_source", name).read_text(encoding="utf-8")
    return _with_includes(name, text, seen)


def _with_includes(name: str, text: str, seen: set[str]) -> str:
    """Return the text of the file `name` with the files that it includes. Includes of a GLSL file stay GLSL."""
    seen.add(name)

    def include(match: re.Match[str]) -> str:
        if match[1] in seen or not name.endswith(".glsl"):
            return _load(match[1], seen)
        return _with_includes(match[1], glsl.read(match[1]), seen)

    return glsl.INCLUDE.sub(include, text)


def _head(model: Model, program: Program) -> list[str]:
    """Return the comment at the top of the file."""
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
        "// Variants: simple, one thread per ray, float32; fused, tiles of rays on the tensor cores. In order:",
        "// check, vectors, uniforms, camera_ray, settings, the field, networks, shade, arguments, grid, cells,",
        "// half_width, march, background, floor_distance, key_light, openness, softbox, floor_color, colors, simple,",
        "// stepping, mma, packed, team, tile, adjoint, queues, fused, picture, unpack, benchmark, main. Of these,",
        "// camera_ray, shade, cells, half_width, march, background, and all from floor_distance to floor_color, are",
        "// functions of the GLSL targets.",
    ]
