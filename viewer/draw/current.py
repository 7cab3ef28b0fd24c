"""The OpenGL context that the caller of a picture has made current: the picture must not take it away."""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

EGL, GLX = "libEGL.so.1", "libGLX.so.0"
DRAW, READ = 0x3059, 0x305A
"""EGL's names of the two surfaces."""

Restore = Callable[[], object]


@contextmanager
def kept_current() -> Iterator[None]:
    """Make the context of EGL or GLX that is current now, if there is one, current again at the end of the block."""
    found = [restore for restore in (_egl(), _glx()) if restore is not None]
    try:
        yield
    finally:
        for restore in found:
            restore()


def _egl() -> Restore | None:
    library = _loaded(EGL)
    context = library and _get(library.eglGetCurrentContext)
    if not library or not context:
        return None
    draw, read = (_get(library.eglGetCurrentSurface, name) for name in (DRAW, READ))
    return partial(_make, library.eglMakeCurrent, _get(library.eglGetCurrentDisplay), draw, read, context)


def _glx() -> Restore | None:
    library = _loaded(GLX)
    context = library and _get(library.glXGetCurrentContext)
    if not library or not context:
        return None
    draw, read = _get(library.glXGetCurrentDrawable), _get(library.glXGetCurrentReadDrawable)
    return partial(_make, library.glXMakeContextCurrent, _get(library.glXGetCurrentDisplay), draw, read, context)


def _make(function: Any, display: int | None, draw: int | None, read: int | None, context: int) -> None:
    """Make a context current; first none, because OSMesa takes it away behind the back of EGL and GLX."""
    function.argtypes = [ctypes.c_void_p] * 4
    function(display, None, None, None)
    function(display, draw, read, context)


def _get(function: Any, *arguments: int) -> int | None:
    """Call a function that returns a pointer, or a number as large as one."""
    function.restype = ctypes.c_void_p
    value: int | None = function(*arguments)
    return value


def _loaded(name: str) -> ctypes.CDLL | None:
    """Return a library that the process has loaded already; None for others, and where the system cannot tell."""
    try:
        return ctypes.CDLL(name, mode=os.RTLD_NOLOAD)
    except (OSError, AttributeError):
        return None
