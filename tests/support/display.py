"""A virtual display, Xvfb, for tests of windows."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from support import needs


@contextmanager
def virtual_display(size: str = "640x480", folder: Path | None = None) -> Iterator[dict[str, str]]:
    """Yield the environment of a process that opens windows. Skips the test without Xvfb.

    size: of the screen, WIDTHxHEIGHT in pixels. folder: where its pixels are kept, in Xvfb_screen0; None: nowhere.
    """
    program = needs.program("Xvfb")
    read, write = os.pipe()
    arguments = [program, "-displayfd", str(write), "-screen", "0", f"{size}x24", "-nolisten", "tcp"]
    arguments += [] if folder is None else ["-fbdir", str(folder)]
    server = subprocess.Popen(arguments, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb does not start"
        yield {**os.environ, "DISPLAY": f":{number}"}
    finally:
        server.terminate()
        server.wait()
