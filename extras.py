"""What to install where a package is missing: the extras of pyproject.toml and the modules that each brings."""

import sys
from importlib.util import find_spec

EXTRAS = {
    "train": {"igl", "lxml", "networkx", "scipy", "threadpoolctl", "torch", "trimesh"},
    "mesh": {"igl", "lxml", "networkx", "scipy", "threadpoolctl", "trimesh"},
    "cluster": {"dask", "distributed"},
    "capture": {"OpenEXR", "scipy"},
    "depth": {"torch", "transformers"},
}
"""Extra that verbs need -> the modules that come with it and not with mplicits alone.

The extra `view` is not among them: the window does without it, and says itself what it lacks.
"""
PACKAGES = {"PIL": "pillow"}
"""Module -> the package that holds it, where the names differ."""


def advice(error: ModuleNotFoundError, extra: str) -> str | None:
    """Say in one line how a missing module is installed.

    error: what an import raised. extra: the one that is proposed where it brings the module, otherwise another that
    does. Returns None where the module is our own, Python's, or there after all: then the error is a bug, and no
    installation mends it.
    """
    module = (error.name or "").partition(".")[0]
    if not module or module in {*sys.stdlib_module_names, "mplicits"} or find_spec(module):
        return None
    bringing = [name for name in (extra, *EXTRAS) if module in EXTRAS[name]]
    if bringing:
        return f"this needs the package '{module}'; run: pip install 'mplicits[{bringing[0]}]'"
    return f"the package '{module}' is missing; run: pip install {PACKAGES.get(module, module)}"
