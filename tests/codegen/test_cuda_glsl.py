"""GLSL functions printed as CUDA: output, refusals, and the vector types that the output needs."""

import re
from pathlib import Path

import pytest

from mplicits import glsl
from mplicits.codegen.printers.glsl_as_cuda import BUILT_INS, MEMBERS, TYPES, UnknownGlslError, glsl_as_cuda
from mplicits.codegen.targets import cuda

SOURCES = Path(cuda.__file__).parent / "cuda_source"
PRINTED = ("camera_ray.glsl", "cells.glsl", "march.glsl", "background.glsl", "shade.glsl", "openness.glsl")
"""Files of glsl/ that the kernels include."""


def test_a_function_has_cuda_qualifiers_and_its_comments() -> None:
    source = """// twice(): what it says.
vec3 twice(vec3 a, inout float sum, out int count, in bool all) {
    /* once */ count = 2;
    sum += 1. + .5 * a.x; // and on
    return 2e-1 * mix(a, a, sum);
}
"""
    assert (
        glsl_as_cuda(source)
        == """// twice(): what it says.
__device__ inline vec3 twice(vec3 a, float &sum, int &count, bool all) {
    /* once */ count = 2;
    sum += 1.f + .5f * a.x; // and on
    return 2e-1f * mix(a, a, sum);
}
"""
    )


def test_a_struct_has_the_constructor_of_glsl() -> None:
    source = "struct Two {\n    bool first;\n    vec2 second; // the last\n};\nTwo two() { return Two(true, vec2(1)); }"
    assert (
        glsl_as_cuda(source)
        == """struct Two {
    int first;
    vec2 second; // the last
    Two() = default;
    __device__ Two(int first, vec2 second) : first(first), second(second) {}
};
__device__ inline Two two() { return Two(true, vec2(1)); }"""
    )


def test_a_global_constant_becomes_constexpr() -> None:
    source = "const int A = 3;\nvoid f() { const float b = 0.5 * float(A); }\nvoid g();"
    assert (
        glsl_as_cuda(source)
        == "inline constexpr int A = 3;\n__device__ inline void f() { const float b = 0.5f * float(A); }\n"
        "__device__ inline void g();"
    )


def test_undeclared_names_are_refused_unless_listed() -> None:
    source = "float f(int i) { return delta[i]; }"
    assert glsl_as_cuda(source, {"delta"}) == "__device__ inline " + source
    with pytest.raises(UnknownGlslError, match="delta"):
        glsl_as_cuda(source)


@pytest.mark.parametrize(
    ("source", "refused"),
    [
        ("uniform float x;", "uniform"),
        ("#version 330\n", "#version"),
        ("in vec3 point;", "in"),
        ("float x = 1.0;", "="),
        ("const float x[2] = float[](1.0, 2.0);", "["),
        ("double f() { return 1.0; }", "double"),
        ("void f() { discard; }", "discard"),
        ("void f() { float a[2] = float[](1.0, 2.0); }", "["),
        ("void f(float a[2]) {}", "["),
        ("void f(const float a) {}", "const"),
        ("void f(highp float a) {}", "highp"),
        ("float f() { return gl_FragCoord.x; }", "gl_FragCoord"),
        ("float f(float a) { return fract(a); }", "fract"),
        ("vec3 f(vec3 a) { return a.zyx; }", "zyx"),
        ("float f(vec3 a) { return a.r; }", "r"),
        ("bool f(bool a) { return a ^^ a; }", "^^"),
        ("int f(int a) { return a ^ 1; }", "^"),
        ("int f() { return 017; }", "017"),
        ("float f() { return 1.0f; }", "1.0f"),
        ("uint f() { return 1U; }", "1U"),
        ("void f() { int a, b; }", "b"),
        ("void f(int if) {}", "if"),
        ("struct S { float a[2]; };", "["),
        ("struct S { ivec2 a; };", "ivec2"),
        ("void f() { if (true) {", ""),
        ("void f() { /* }", "/*"),
    ],
)
def test_glsl_without_a_cuda_equivalent_is_refused(source: str, refused: str) -> None:
    with pytest.raises(UnknownGlslError) as caught:
        glsl_as_cuda("// one\n" + source)
    assert f"'{refused}" in str(caught.value)
    assert "line 2" in str(caught.value)


def test_vectors_cuh_defines_what_the_printer_accepts() -> None:
    vectors = (SOURCES / "vectors.cuh").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", " ".join(re.sub("//.*", "", glsl.load(name)) for name in PRINTED)))
    for name in BUILT_INS:
        assert re.search(rf"^__device__ inline \w+ {name}\(", vectors, re.MULTILINE), name
    for name in TYPES - {"bool", "int", "uint", "float"}:
        assert f"struct {name} {{" in vectors
    assert words >= (BUILT_INS | TYPES) - {"vec4"}, "vec4 is the field's"
    declared = re.findall(r"^    (?:float|vec3) ([\w, ]+);", vectors, re.MULTILINE)
    assert {name for names in declared for name in names.split(", ")} - {"a", "b", "c"} == MEMBERS
