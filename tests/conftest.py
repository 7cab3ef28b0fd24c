"""Shared fixtures, and the one option that rewrites golden files."""

import os
import shutil
import subprocess
from collections.abc import Iterator

import pytest

from codegen.errors import UserError
from desk_fixture import make  # noqa: F401 (a fixture)
from viewer.context import Context, open_osmesa


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write the golden files; look at each before commit")


@pytest.fixture(scope="session")
def osmesa() -> Iterator[Context]:
    """Software GL, the same on every machine."""
    try:
        context = open_osmesa()
    except UserError as error:
        pytest.skip(str(error))
    yield context
    context.release()


@pytest.fixture(scope="session")
def xvfb() -> Iterator[dict[str, str]]:
    """The environment of a process that may open windows, on a display of our own."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed (Debian: xvfb)")
    read, write = os.pipe()
    arguments = ["Xvfb", "-displayfd", str(write), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
    server = subprocess.Popen(arguments, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    if not number:
        pytest.skip("Xvfb does not start")
    yield {**os.environ, "DISPLAY": f":{number}"}
    server.terminate()
    server.wait()
