"""All that a stranger gets, made once, as a stranger makes it. The tests of this folder open it."""

import fcntl
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.stranger import MODULE, Stranger, ended, plain_user, stranger

KEPT = "MPLICITS_SHIPPED"
"""Environment variable: a folder of an earlier run, to open again what is in it."""


def make() -> Stranger:
    """Build the wheel, install it alone, and make all that it makes for others."""
    made = stranger()
    made.run("python -m pip wheel -q --no-deps -w dist ./mplicits && python -m pip install -q dist/*.whl")
    at_once = [
        "mplicits gallery site",
        f"mplicits bake {MODULE} --target module -o {MODULE}.js && mplicits studio -o studio.html",
    ]
    for process in [made.start(command) for command in at_once]:
        ended(process)
    return made


@pytest.fixture(scope="session")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stranger]:
    """The stranger's folder with `site` (the gallery), the module and studio.html, which all workers share."""
    if kept := os.environ.get(KEPT):
        yield Stranger(Path(kept), plain_user())
        return
    root = tmp_path_factory.getbasetemp()
    place = (root.parent if root.name.startswith("popen") else root) / "shipped"
    with place.open("a+") as users, place.with_suffix(".lock").open("a") as makers:
        fcntl.flock(makers, fcntl.LOCK_EX)
        fcntl.flock(users, fcntl.LOCK_SH)
        path = place.read_text()
        made = Stranger(Path(path), plain_user()) if path and Path(path).exists() else make()
        place.write_text(str(made.folder))
        fcntl.flock(makers, fcntl.LOCK_UN)
        yield made
        try:
            fcntl.flock(users, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return  # another worker uses it
        shutil.rmtree(made.folder, ignore_errors=True)
