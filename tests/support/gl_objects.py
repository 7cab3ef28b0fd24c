"""Counts OpenGL objects and memory, to find leaks."""

import ctypes
import resource
from collections.abc import Callable
from pathlib import Path

KINDS = ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader")
NAMES = 10_000
"""Number of names that are checked; Mesa does not reuse the names of deleted objects."""


def count_objects(address: Callable[[str], int]) -> int:
    """Count the objects of the current context. address: of an OpenGL function, by its name."""
    ctypes.CFUNCTYPE(None, ctypes.c_uint)(address("glUseProgram"))(0)  # OpenGL keeps a deleted program in use
    checks = [ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(address(f"glIs{kind}")) for kind in KINDS]
    return sum(bool(exists(name)) for exists in checks for name in range(1, NAMES))


def resident() -> int:
    """Return the resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
