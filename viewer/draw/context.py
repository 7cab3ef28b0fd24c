"""Opens OpenGL contexts: OSMesa (software, no display), EGL (a GPU or software, no display), or a GLFW window.

An open context is not current; `with context:` makes it current, so that several kinds live in one process.
"""

import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl

from ...model.errors import UserError
from ...model.files import silent_library
from .osmesa import OSMesa, load_library
from .shader_cache import guard_shader_cache

EGL_LIBRARY = "libEGL.so.1"
EGL_DEVICES = 8
"""Number of EGL devices to try: the user may lack the permission for the first ones."""


_PROCESSES: set[int] = set()
"""Processes that have opened a context: this one, or the one that it was forked from."""


@dataclass
class Context:
    """An OpenGL context, 3.3 core or newer. It is current only inside `with context:`, which may nest."""

    kind: str
    """osmesa, egl or window."""
    gl: moderngl.Context
    renderer: str
    """The driver's name."""
    handle: Any = None
    """The GLFW window of the kind "window"."""
    _depth: int = 0
    """Number of nested `with context:`."""

    @property
    def software(self) -> bool:
        """Whether the driver is a software rasterizer of Mesa, which limits the loop iterations of a fragment."""
        return any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe"))

    def __enter__(self) -> moderngl.Context:
        if self._depth == 0:
            self.gl.__enter__()  # type: ignore[no-untyped-call]
        self._depth += 1
        return self.gl

    def __exit__(self, *error: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.gl.__exit__(*error)  # type: ignore[no-untyped-call]

    def release(self) -> None:
        self.gl.release()


def check_process() -> None:
    """Raise UserError in a process that was forked from one with a context: the driver's threads are not in it."""
    if _PROCESSES and os.getpid() not in _PROCESSES:
        raise UserError(
            "this process was forked after a picture, and OpenGL does not survive that; start it by multiprocessing's "
            "method 'spawn'"
        )


def open_context(kind: str = "auto") -> Context:
    """Open a context of the kind osmesa, egl, window, or auto: the first of egl, osmesa and window that opens.

    Raises UserError, one line that names the package or display to add.
    """
    check_process()
    guard_shader_cache()
    _PROCESSES.add(os.getpid())
    openers: dict[str, Callable[[], Context]] = {"egl": open_egl, "osmesa": open_osmesa, "window": open_window}
    if kind in openers:
        return openers[kind]()
    if kind != "auto":
        raise UserError(f"context {kind!r} is none of auto, osmesa, egl, window")
    errors = []
    for opener in openers.values():
        try:
            return opener()
        except UserError as error:
            errors.append(str(error))
    raise UserError(f"no way to draw with OpenGL here: {'; '.join(errors)}")


def open_osmesa() -> Context:
    """Open a context of Mesa's off-screen software rasterizer. Raises UserError if it is missing or fails."""
    return _wrap("osmesa", OSMesa())


def open_egl() -> Context:
    """Open an EGL context without a surface. Raises UserError if EGL is missing or no device gives a context."""
    advice = "on Debian: apt install libegl1 libgl1-mesa-dri"
    load_library((EGL_LIBRARY,), "EGL", advice)
    first_error: Exception | None = None
    for device in range(EGL_DEVICES):
        try:
            # GL functions come from eglGetProcAddress (EGL 1.5), so libGL, which needs X11, is not loaded.
            settings: Any = {"backend": "egl", "libegl": EGL_LIBRARY, "libgl": EGL_LIBRARY, "device_index": device}
            with silent_library():
                gl = moderngl.create_context(330, standalone=True, **settings)
        except Exception as error:  # glcontext raises bare Exception
            first_error = first_error or error
            continue
        return _checked("egl", gl)
    raise UserError(f"EGL gives no OpenGL 3.3 context ({first_error}); {advice}")


def open_window(size: tuple[int, int] = (16, 16), title: str = "mplicits", visible: bool = False) -> Context:
    """Open a GLFW window, the context's `handle`.

    size: (width, height) in screen coordinates. Raises UserError if a display, GLFW or OpenGL 3.3 is missing.
    """
    try:
        import glfw
    except ImportError as error:
        raise UserError(f"the GLFW library does not load ({str(error).splitlines()[0]}); pip install glfw") from None
    messages = ["no reason given"]
    glfw.set_error_callback(
        lambda _, text: messages.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
    )
    window = None
    guard_shader_cache()
    if glfw.init():
        glfw.default_window_hints()
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, glfw.TRUE),
            (glfw.VISIBLE, glfw.TRUE if visible else glfw.FALSE),
            (glfw.SCALE_TO_MONITOR, glfw.TRUE if visible else glfw.FALSE),
        ):
            glfw.window_hint(hint, value)
        window = glfw.create_window(*size, title, None, None)
    if not window:
        raise UserError(
            "no window: a display is needed (an X11 or Wayland session, or: xvfb-run COMMAND); "
            f"GLFW says: {' '.join(messages[-1].split())}; without a display, `mplicits render` draws a picture and "
            "`mplicits bake --target html` writes a web page"
        )
    return _wrap("window", _Glfw(window), window)


class _Glfw:
    """A GLFW window with the methods that moderngl expects of a native context."""

    def __init__(self, window: Any) -> None:
        import glfw

        self._glfw, self._window = glfw, window

    def load_opengl_function(self, name: str) -> int:
        return ctypes.cast(self._glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    def __enter__(self) -> None:
        self._glfw.make_context_current(self._window)

    def __exit__(self) -> None:  # noqa: PLE0302 (moderngl calls it without arguments)
        self._glfw.make_context_current(None)  # type: ignore[arg-type]

    def release(self) -> None:
        if self._window:
            self.__exit__()
            self._glfw.destroy_window(self._window)
        self._window = None


def _wrap(kind: str, native: OSMesa | _Glfw, handle: Any = None) -> Context:
    """Make a Context of a native one. Raises UserError if it has no OpenGL 3.3."""
    native.__enter__()
    try:
        # If the loader returned 0, moderngl would jump to address 0.
        if not native.load_opengl_function("glGetString"):
            raise UserError(f"the {kind} context gives no OpenGL functions")
        settings: Any = {"context": native}
        gl = moderngl.create_context(330, **settings)
    except UserError:
        native.release()
        raise
    except Exception as error:  # moderngl and glcontext raise bare Exception
        native.release()
        raise UserError(f"the {kind} context is refused ({error}); OpenGL 3.3 is needed") from None
    return _checked(kind, gl, handle)


def _checked(kind: str, gl: moderngl.Context, handle: Any = None) -> Context:
    """Make a Context of moderngl's, and make it not current. Raises UserError if its version is too old."""
    renderer, version = str(gl.info["GL_RENDERER"]), gl.version_code
    gl.__exit__(None, None, None)  # type: ignore[no-untyped-call]
    if version < 330:
        gl.release()
        raise UserError(f"the {kind} context has OpenGL {version / 100:.1f} ({renderer}); 3.3 is needed")
    return Context(kind, gl, renderer, handle)
