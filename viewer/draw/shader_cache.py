"""Mesa's cache of compiled shaders: where it cannot be written, it is turned off.

Mesa maps its files into memory: on a full disk, the system ends the process. In a folder that is read-only, Mesa prints
a line of its own.
"""

import contextlib
import os
import shutil
from pathlib import Path

LEAST = 64 << 20
"""Free bytes that the cache needs."""
OFF = ("MESA_SHADER_CACHE_DISABLE", "MESA_GLSL_CACHE_DISABLE")
"""Environment variables that turn the cache off, of new and old versions of Mesa."""


def guard_shader_cache() -> None:
    """Turn the cache off for this process, before the driver is loaded, where its folder is full or read-only."""
    folder = _folder()
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    full = False
    with contextlib.suppress(OSError):
        full = shutil.disk_usage(folder).free < LEAST
    if full or not os.access(folder, os.W_OK):
        for name in OFF:
            os.environ.setdefault(name, "true")


def _folder() -> Path:
    """Return the folder of the cache, which may not exist."""
    named = os.environ.get("MESA_SHADER_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    return Path(named) if named else Path(_home(), ".cache")


def _home() -> str:
    """Return the user's folder. Mesa takes it from the system's list of users, whatever HOME says."""
    try:
        import pwd

        return pwd.getpwuid(os.getuid()).pw_dir
    except (ImportError, KeyError):
        return os.path.expanduser("~")
