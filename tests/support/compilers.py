"""Compilers that check generated texts. A test skips where its compiler is missing."""

import subprocess
from pathlib import Path
from typing import Any

from support import needs

ES = "#version 300 es\nprecision highp float; precision highp int;\n"
"""First lines of GLSL ES 3.00."""


def check_glsl(text: str, folder: Path) -> None:
    """Compile a fragment shader with glslang."""
    needs.program("glslang")
    (folder / "shader.frag").write_text(text)
    _check(["glslangValidator", "shader.frag"], folder)


def check_hlsl(text: str, folder: Path, stage: str = "frag") -> bytes:
    """Compile HLSL with the entry point main. Returns SPIR-V."""
    needs.program("glslang")
    (folder / "shader.hlsl").write_text(text)
    _check(["glslangValidator", "-D", "-V", "-e", "main", "-S", stage, "shader.hlsl", "-o", "shader.spv"], folder)
    return (folder / "shader.spv").read_bytes()


def check_c(text: str, folder: Path, *flags: str) -> None:
    """Compile C with all warnings as errors."""
    needs.program("gcc")
    (folder / "text.c").write_text(text)
    _check(["gcc", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "text.c", "-lm", *flags], folder)


def webgpu() -> Any:
    """Return a WebGPU device."""
    utils = needs.package("wgpu.utils")
    try:
        return utils.get_default_device()
    except RuntimeError as error:
        if "adapter" in str(error).lower():
            needs.lack("a driver of Vulkan")
        raise


def _check(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
