"""The extras of pyproject.toml: which modules each brings, and how a user installs one that is missing."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec


@dataclass(frozen=True)
class Extra:
    """An extra of pyproject.toml."""

    modules: set[str]
    """Modules that come with the extra and not with mplicits itself."""
    size: str
    """Disk space that the packages take, for people."""


_MESH = {"igl", "lxml", "networkx", "scipy", "threadpoolctl", "trimesh"}
EXTRAS = {
    "mesh": Extra(_MESH, "220 MB"),
    "train": Extra({*_MESH, "torch"}, "1.1 GB, with CUDA several"),
    "capture": Extra({"OpenEXR", "scipy"}, "150 MB"),
    "formats": Extra({"DracoPy", "laspy", "lazrs", "pye57", "pypcd4"}, "90 MB"),
    "meshopt": Extra({"meshoptimizer"}, "2 MB, and a compiler of C++"),
    "depth": Extra({"torch", "transformers"}, "1.2 GB, with CUDA several"),
}
"""Name -> extra that a verb may need. The window works without the extra `view`, and says what it lacks."""
PACKAGES = {"PIL": "pillow"}
"""Module -> package, where the names differ."""
RUN = "MPLICITS_RUN"
"""Environment variable: the path of the script `run`, when that runs mplicits. Then missing extras are installed."""


def missing_module(error: ModuleNotFoundError) -> str | None:
    """Return the module that an installation would bring; None if the error is a bug.

    An error is a bug if the module is ours, Python's, or installed.
    """
    module = (error.name or "").partition(".")[0]
    return None if not module or module in {*sys.stdlib_module_names, "mplicits"} or find_spec(module) else module


def extra_of(module: str, preferred: str = "mesh") -> str | None:
    """Return the extra that brings a module: `preferred` if it does; None if no extra does."""
    return next((name for name in (preferred, *EXTRAS) if module in EXTRAS[name].modules), None)


def advice(error: ModuleNotFoundError, preferred: str = "mesh") -> str | None:
    """Say in one line how to install a missing module; None if the error is a bug. preferred: as of `extra_of`.

    The error's message may be the name of what needs the module.
    """
    module = missing_module(error)
    if module is None:
        return None
    extra = extra_of(module, preferred)
    what = str(error) if str(error).isidentifier() else "this"  # the name of an extension of a format
    if extra:
        return f"{what} needs the package '{module}'; run: pip install 'mplicits[{extra}]' ({EXTRAS[extra].size})"
    return f"the package '{module}' is missing; run: pip install {PACKAGES.get(module, module)}"


def install_and_repeat(error: ModuleNotFoundError, preferred: str, argv: Sequence[str]) -> None:
    """Let the script `run`, if it runs this process, install the missing extra and then repeat the command line."""
    script, module = os.environ.get(RUN), missing_module(error)
    extra = module and extra_of(module, preferred)
    if script and extra:
        print(f"mplicits: '{argv[0]}' needs more packages; installing {EXTRAS[extra].size} (once)", file=sys.stderr)
        sys.stderr.flush()
        os.execv(script, [script, "--install", extra, *argv])
