"""Names that a language reserves are refused, and all other names compile."""

import inspect
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from pygments.lexers.c_cpp import CppLexer
from pygments.lexers.graphics import GLShaderLexer, HLSLShaderLexer

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets.function_target import function_name
from mplicits.codegen.targets.reserved_names import RESERVED, is_reserved
from mplicits.model.errors import UserError
from support import needs
from support.compilers import ES, check_c, check_glsl, check_hlsl, webgpu
from support.random_model import random_model

INSIDE = set(
    re.findall(r"\w+", "p q f level time x y z a1 c2 r3 n at out np result normal color o i h0 s torus island")
)
"""Names of the texts' own parameters and variables, and words that only begin like library functions."""
STANDARD_HEADERS = re.findall(
    r"\w+", "complex ctype fenv inttypes locale math setjmp signal stdio stdlib string time uchar wchar wctype"
)
FURTHER_HEADERS = re.findall(
    r"\w+",
    "assert errno float iso646 limits stdalign stdarg stdatomic stdbool stddef stdint stdnoreturn tgmath threads",
)
"""Headers of C11 that declare macros and types alone, or functions that GCC does not list."""
HIGHLIGHTED = {
    word
    for lexer in (GLShaderLexer, HLSLShaderLexer, CppLexer)
    for base in lexer.__mro__
    if base.__module__.startswith("pygments.lexers")
    for word in re.findall(r"\w+", inspect.getsource(base))
}
"""The words that an editor highlights, and others of the same files."""
REFUSED = [
    *(("c", name) for name in ("log", "exp", "gamma", "y1", "cosf", "printf", "new", "main", "NULL", "EOF", "E2BIG")),
    *(("python", name) for name in ("lambda", "len", "np")),
    *(("glsl", name) for name in ("step", "length", "distance", "vec3", "dmat2x3", "input", "gl_x")),
    *(("hlsl", name) for name in ("lerp", "saturate", "float3", "min16float2", "technique", "Texture2D")),
    *(("wgsl", name) for name in ("select", "step", "mat2x3f", "fn", "self")),
]


@pytest.mark.parametrize(("target", "name"), REFUSED)
def test_a_reserved_name_is_refused(target: str, name: str) -> None:
    with pytest.raises(UserError, match=f"--name {name}: {target} reserves this name; choose another"):
        function_name(name, "model", target)
    assert function_name(None, name, target) == (f"{name}_sdf" if name.islower() else name.lower())


def test_c_reserves_all_functions_of_its_headers(tmp_path: Path) -> None:
    """GCC lists the functions that C11's headers declare, and those of the GNU math.h."""
    needs.program("gcc")
    for standard, headers in (("c11", STANDARD_HEADERS), ("gnu17", ["math"])):
        (tmp_path / "headers.c").write_text("".join(f"#include <{header}.h>\n" for header in headers))
        command = ["gcc", f"-std={standard}", "-fsyntax-only", "-aux-info", "names.txt", "headers.c"]
        subprocess.run(command, cwd=tmp_path, check=True)
        declared = set(re.findall(r"\b([a-z]\w*) \(", (tmp_path / "names.txt").read_text())) - {"void"}
        assert len(declared) > 200
        assert [name for name in sorted(declared) if not is_reserved(name, "c")] == []


def test_c_reserves_all_macros_of_its_headers(tmp_path: Path) -> None:
    needs.program("gcc")
    headers = [*STANDARD_HEADERS, *FURTHER_HEADERS]
    (tmp_path / "headers.c").write_text("".join(f"#include <{header}.h>\n" for header in headers))
    command = ["gcc", "-std=c11", "-dM", "-E", "headers.c"]
    listed = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    macros = {
        name for name in re.findall(r"^#define (\w+)", listed, re.MULTILINE) if name[0] != "_" and "__" not in name
    }
    assert len(macros) > 500
    assert [name for name in sorted(macros) if not is_reserved(name, "c")] == []


@pytest.mark.parametrize("standard", ["c++11", "gnu++20"])
def test_c_reserves_what_its_header_declares_in_cpp(standard: str) -> None:
    """There <math.h> includes <stdlib.h>. Every other word of the headers may be the name of the function."""
    needs.program("g++")
    command = ["g++", f"-std={standard}", "-x", "c++", "-w", "-"]
    include = "#include <math.h>\n"

    def run(text: str, *options: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, *options], input=text, capture_output=True, text=True, check=False)

    words = re.findall(r"\b[A-Za-z]\w*\b", run(include, "-E").stdout)
    words += re.findall(r"^#define (\w+)", run(include, "-E", "-dM").stdout, re.MULTILINE)
    names = [word for word in sorted({*words}) if re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", word)]
    names = [name for name in names if not is_reserved(name, "c")]
    assert len(names) > 300
    functions = "".join(HEADS["c"].replace("NAME", name) for name in names)
    assert run(include + functions, "-fsyntax-only").stderr == ""


HEADS = {
    "glsl": "float NAME(vec3 p) { return p.x; }\n",
    "wgsl": "fn NAME(p: vec3f) -> f32 { return p.x; }\n",
    "hlsl": "float NAME(float3 p) { return p.x; }\n",
    "c": "float NAME(const float p[3]) { return p[0]; }\n",
    "python": "def NAME(p): return p\n",
}
"""Target -> a function with the head of the distance function."""


def compile_text(target: str, text: str, folder: Path) -> None:
    match target:
        case "glsl":
            for version in ("#version 330\n", ES):
                check_glsl(f"{version}{text}out vec4 c_; void main() {{ c_ = vec4(0.); }}\n", folder)
        case "wgsl":
            webgpu().create_shader_module(code=text)
        case "hlsl":
            check_hlsl(text + "float4 main() : SV_Target { return 0; }\n", folder)
        case "c":
            for standard in ("c99", "gnu17"):
                check_c(text, folder, f"-std={standard}", "-fsyntax-only")
        case _:
            names: dict[str, Any] = {}
            exec(text, names)
            assert names["q"]([0, 0, 0]).shape == ()


@pytest.mark.parametrize("target", HEADS)
def test_every_other_name_compiles(target: str, tmp_path: Path) -> None:
    """A language compiles the reserved words of all other languages, and names that its own text uses inside."""
    text = TARGETS[target](random_model((4, 0)), name="NAME")
    assert HEADS[target].partition(")")[0] in text
    words = {word for words in RESERVED.values() for word in words} | HIGHLIGHTED
    words = {word for word in words if re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", word)}
    names = [name for name in sorted(words | INSIDE) if not is_reserved(name, target)]
    assert len(names) > 500
    texts = [(text if name in INSIDE else HEADS[target]).replace("NAME", name) for name in names]
    compile_text(target, "".join(texts), tmp_path)
