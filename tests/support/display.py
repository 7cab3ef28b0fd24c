"""A virtual display, Xvfb, for tests of windows."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MISSING = "Xvfb is not installed (Debian: xvfb)"


@contextmanager
def virtual_display(size: str = "640x480", folder: Path | None = None) -> Iterator[dict[str, str]]:
    """Yield the environment of a process that opens windows. Raises OSError if Xvfb is missing or does not start.

    size: of the screen, WIDTHxHEIGHT in pixels. folder: where its pixels are kept, in Xvfb_screen0; None: nowhere.
    """
    if shutil.which("Xvfb") is None:
        raise OSError(MISSING)
    read, write = os.pipe()
    arguments = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{size}x24", "-nolisten", "tcp"]
    arguments += [] if folder is None else ["-fbdir", str(folder)]
    server = subprocess.Popen(arguments, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        if not number:
            raise OSError("Xvfb does not start")
        yield {**os.environ, "DISPLAY": f":{number}"}
    finally:
        server.terminate()
        server.wait()
