"""OSMesa, which is software OpenGL without a display, as a native context for moderngl."""

import ctypes

from ...model.errors import UserError

OSMESA_LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
"""Names of the library, the newest first."""
GL_VERSION = (3, 3)
"""Major and minor version of OpenGL that is asked for."""


class OSMesa:
    """A context of libOSMesa with the methods that moderngl expects; a 1 x 1 buffer stands in for the screen.

    Raises UserError where the library is missing or too old.
    """

    def __init__(self) -> None:
        advice = "on Debian: apt install libosmesa6"
        library = load_library(OSMESA_LIBRARIES, "OSMesa", advice)
        try:
            create, self._make_current = library.OSMesaCreateContextAttribs, library.OSMesaMakeCurrent
            self._address, self._destroy = library.OSMesaGetProcAddress, library.OSMesaDestroyContext
        except AttributeError:
            raise UserError(f"OSMesa is older than Mesa 12 and has no OpenGL 3.3; {advice}") from None
        create.restype, create.argtypes = ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_void_p]
        self._make_current.restype = ctypes.c_ubyte
        self._make_current.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_int]
        self._address.restype, self._address.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
        self._destroy.restype, self._destroy.argtypes = None, [ctypes.c_void_p]
        rgba, core = 0x1908, 0x34
        # OSMESA_FORMAT, DEPTH_BITS, PROFILE, CONTEXT_MAJOR_VERSION, CONTEXT_MINOR_VERSION
        settings = {0x22: rgba, 0x30: 0, 0x33: core, 0x36: GL_VERSION[0], 0x37: GL_VERSION[1]}
        # Names and values in turn, and zeros at the end.
        attributes = (ctypes.c_int * (2 * len(settings) + 2))(*(n for pair in settings.items() for n in pair))
        self._buffer = (ctypes.c_ubyte * 4)()
        self._context = create(attributes, None)
        if not self._context or not self._make_it_current():
            raise UserError(f"OSMesa gives no OpenGL 3.3 context; {advice}")
        self.__exit__()

    def _make_it_current(self) -> bool:
        """Make the context current, and return whether that went well."""
        unsigned_byte = 0x1401
        return bool(self._make_current(self._context, self._buffer, unsigned_byte, 1, 1))

    def load_opengl_function(self, name: str) -> int:
        return self._address(name.encode()) or 0

    def __enter__(self) -> None:
        if not self._context or not self._make_it_current():
            raise RuntimeError("the OSMesa context is gone")

    def __exit__(self) -> None:  # noqa: PLE0302 (moderngl calls it so)
        self._make_current(None, None, 0, 0, 0)

    def release(self) -> None:
        if self._context:
            self.__exit__()
            self._destroy(self._context)
        self._context = None


def load_library(names: tuple[str, ...], product: str, advice: str) -> ctypes.CDLL:
    """Load the first of the libraries `names` that there is.

    Raises UserError where there is none; it says that the `product` is missing, and as `advice` how to get it.
    """
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    raise UserError(f"{product} is not installed ({names[0]}); {advice}")
