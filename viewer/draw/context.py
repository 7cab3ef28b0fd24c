"""Opens OpenGL contexts: OSMesa (software, no display), EGL (headless, a GPU where there is one), a GLFW window.

No context is current after it was opened, so that several kinds can live in one process: `with context:` makes one
current.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import moderngl

from ...model.errors import UserError
from .osmesa import OSMesa, load_library

EGL_LIBRARY = "libEGL.so.1"
EGL_DEVICES = 8
"""Number of EGL devices that are tried in turn: the first ones may be GPUs that this user has no right to open."""


class NoDisplayError(UserError):
    """There is no display to open a window on."""


@dataclass
class Context:
    """An OpenGL context of version 3.3 core or newer. It is current only inside `with context:`, which may nest."""

    kind: str
    """osmesa, egl or window."""
    gl: moderngl.Context
    """What `with context as gl:` gives."""
    renderer: str
    """What the driver calls itself."""
    handle: Any = None
    """The GLFW window, where the kind is window."""
    _depth: int = 0
    """How many `with context:` are being run."""

    @property
    def software(self) -> bool:
        """Whether the driver is one of Mesa's software rasterisers, which bound the loop iterations of a fragment."""
        return any(name in self.renderer.lower() for name in ("llvmpipe", "softpipe"))

    def __enter__(self) -> moderngl.Context:
        if self._depth == 0:
            self.gl.__enter__()  # type: ignore[no-untyped-call]
        self._depth += 1
        return self.gl

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.gl.__exit__(kind, error, trace)  # type: ignore[no-untyped-call]

    def release(self) -> None:
        """Destroy the context, which must not be current."""
        self.gl.release()


def open_context(kind: str = "auto") -> Context:
    """Open a context of `kind`: osmesa, egl, window or auto.

    auto takes EGL first (a GPU where there is one, and Mesa's software rasteriser otherwise; no display needed), then
    OSMesa (the same rasteriser, for machines whose EGL does not work), then a hidden window (where there is neither).
    Raises UserError, one line that names the package or display to add, where none can be had.
    """
    openers: dict[str, Callable[[], Context]] = {"osmesa": open_osmesa, "egl": open_egl, "window": open_window}
    if kind in openers:
        return openers[kind]()
    if kind != "auto":
        raise UserError(f"context {kind!r} is none of {', '.join(('auto', *openers))}")
    refusals = []
    for choice in ("egl", "osmesa", "window"):
        try:
            return openers[choice]()
        except UserError as refusal:
            refusals.append(str(refusal))
    raise UserError(f"no way to draw with OpenGL here: {'; '.join(refusals)}")


def open_osmesa() -> Context:
    """Open a context of Mesa's off-screen software rasteriser. Raises UserError where it is missing or refuses."""
    return _wrap("osmesa", OSMesa())


def open_egl() -> Context:
    """Open an EGL context without a surface. Raises UserError where EGL is missing or no device gives a context."""
    advice = "on Debian: apt install libegl1 libgl1-mesa-dri"
    load_library((EGL_LIBRARY,), "EGL", advice)
    refusal: Exception | None = None
    for device in range(EGL_DEVICES):
        try:
            # GL functions come from eglGetProcAddress (EGL 1.5): libGL, which wants X11, is not needed.
            settings: Any = {"backend": "egl", "libegl": EGL_LIBRARY, "libgl": EGL_LIBRARY, "device_index": device}
            gl = moderngl.create_context(330, standalone=True, **settings)
        except Exception as error:  # glcontext raises bare Exception
            refusal = refusal or error
            continue
        return _described("egl", gl)
    raise UserError(f"EGL gives no OpenGL 3.3 context ({refusal}); {advice}")


def open_window(size: tuple[int, int] = (16, 16), title: str = "mplicits", visible: bool = False) -> Context:
    """Open a GLFW window and its context, whose `handle` is the window.

    size: (width, height) in screen coordinates. Raises NoDisplayError where there is no display, and UserError where
    GLFW or OpenGL 3.3 is missing.
    """
    advice = "a display is needed (an X11 or Wayland session, or: xvfb-run COMMAND)"
    try:
        import glfw
    except ImportError as error:
        raise UserError(f"the GLFW library does not load ({str(error).splitlines()[0]}); pip install glfw") from None
    messages: list[str] = []
    glfw.set_error_callback(_collector(messages))

    def refuse() -> NoDisplayError:
        reason = messages[-1] if messages else "no reason given"
        return NoDisplayError(f"no window: {advice}; GLFW says: {' '.join(reason.split())}")

    if not glfw.init():
        raise refuse()
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
        raise refuse()
    return _wrap("window", _Glfw(window), window)


def _collector(messages: list[str]) -> Callable[[int, Any], None]:
    """Return an error callback for GLFW that appends each message to `messages`."""
    return lambda code, text: messages.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))


class _Glfw:
    """A GLFW window with the methods that moderngl expects of a native context."""

    def __init__(self, window: Any) -> None:
        self._window = window

    def load_opengl_function(self, name: str) -> int:
        import glfw

        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    def __enter__(self) -> None:
        import glfw

        glfw.make_context_current(self._window)

    def __exit__(self) -> None:  # noqa: PLE0302 (moderngl calls it so)
        import glfw

        glfw.make_context_current(None)  # type: ignore[arg-type]

    def release(self) -> None:
        import glfw

        if self._window:
            self.__exit__()
            glfw.destroy_window(self._window)
        self._window = None


def _wrap(kind: str, native: OSMesa | _Glfw, handle: Any = None) -> Context:
    """Make a Context of a native one. Raises UserError where that gives no OpenGL 3.3."""
    native.__enter__()
    try:
        # A loader that returns 0 would make moderngl jump to address 0.
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
    return _described(kind, gl, handle)


def _described(kind: str, gl: moderngl.Context, handle: Any = None) -> Context:
    """Make a Context of moderngl's, which is current now and not afterwards. Raises UserError where it is too old."""
    renderer, version = str(gl.info["GL_RENDERER"]), gl.version_code
    gl.__exit__(None, None, None)  # type: ignore[no-untyped-call]
    if version < 330:
        gl.release()
        raise UserError(f"the {kind} context has OpenGL {version / 100:.1f} ({renderer}); 3.3 is needed")
    return Context(kind, gl, renderer, handle)
