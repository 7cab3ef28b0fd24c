"""OSMesa, software OpenGL without a display, as a native context for moderngl."""

import ctypes
import os

from ...model.errors import UserError
from ...model.files import show

OSMESA_LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
"""Names of the library, newest first."""
DRIVERS = ("llvmpipe", "softpipe")
"""Drivers that OSMesa can have."""
GL_VERSION = (3, 3)
"""Major and minor version of OpenGL to request."""
ADVICE = "on Debian: apt install libosmesa6"
RGBA, CORE, UNSIGNED_BYTE = 0x1908, 0x34, 0x1401
FORMAT, DEPTH_BITS, PROFILE, CONTEXT_MAJOR_VERSION, CONTEXT_MINOR_VERSION = 0x22, 0x30, 0x33, 0x36, 0x37


class OSMesa:
    """A context of libOSMesa with the methods that moderngl expects; its screen is a buffer of 1 x 1 pixel.

    Raises UserError if the library is missing or too old.
    """

    def __init__(self) -> None:
        driver = os.environ.get("GALLIUM_DRIVER")
        if driver and driver not in DRIVERS:  # OSMesa would end the process.
            raise UserError(
                f"OSMesa has no driver {show(driver)[:60]}; unset GALLIUM_DRIVER, or set {' or '.join(DRIVERS)}"
            )
        library = load_library(OSMESA_LIBRARIES, "OSMesa", ADVICE)
        try:
            create, self._make_current = library.OSMesaCreateContextAttribs, library.OSMesaMakeCurrent
            self._address, self._destroy = library.OSMesaGetProcAddress, library.OSMesaDestroyContext
        except AttributeError:
            raise UserError(f"OSMesa is older than Mesa 12 and has no OpenGL 3.3; {ADVICE}") from None
        create.restype, create.argtypes = ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_void_p]
        self._make_current.restype = ctypes.c_ubyte
        self._make_current.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_int]
        self._address.restype, self._address.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
        self._destroy.restype, self._destroy.argtypes = None, [ctypes.c_void_p]
        major, minor = GL_VERSION
        attributes = [FORMAT, RGBA, DEPTH_BITS, 0, PROFILE, CORE]
        attributes += [CONTEXT_MAJOR_VERSION, major, CONTEXT_MINOR_VERSION, minor, 0, 0]
        self._buffer = (ctypes.c_ubyte * 4)()
        self._context = create((ctypes.c_int * len(attributes))(*attributes), None)
        if not self._context or not self._becomes_current():
            raise UserError(f"OSMesa gives no OpenGL 3.3 context; {ADVICE}")
        self.__exit__()

    def _becomes_current(self) -> bool:
        return bool(self._make_current(self._context, self._buffer, UNSIGNED_BYTE, 1, 1))

    def load_opengl_function(self, name: str) -> int:
        return self._address(name.encode()) or 0

    def __enter__(self) -> None:
        if not self._context or not self._becomes_current():
            raise RuntimeError("the OSMesa context is gone")

    def __exit__(self) -> None:  # noqa: PLE0302 (moderngl calls it without arguments)
        self._make_current(None, None, 0, 0, 0)

    def release(self) -> None:
        if self._context:
            self.__exit__()
            self._destroy(self._context)
        self._context = None


def load_library(names: tuple[str, ...], product: str, advice: str) -> ctypes.CDLL:
    """Load the first library of `names` that exists. Raises UserError: `product` is missing, and the `advice`."""
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    raise UserError(f"{product} is not installed ({names[0]}); {advice}")
