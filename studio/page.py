"""The scripts of the studio, from app/, and its kernel, from kernel/."""

import re
from importlib.resources import files

WORKER = ("kernel.js", "batches.js", "tree.js", "winding.js", "shape.js", "sampling.js", "worker.js")
"""Modules of the workers' script, in its order."""
MESHES = ("mesh_parts.js", "obj.js", "ply.js", "stl.js", "glb.js", "mesh_file.js")
"""Modules that read mesh files, in their order."""
TRAINER = ("kernel.js", "batches.js", "optimizer.js", "team.js", "fit.js", "training.js", "model_file.js")
"""Modules of the page that train a model, in their order."""

_MODULE_LINE = re.compile(r"^import [^;]*;\n|^export (?=\w)", re.MULTILINE)


def script(names: tuple[str, ...]) -> str:
    """Join modules of app/ into one script, without their imports and exports."""
    app = files(__package__) / "app"
    return "".join(_MODULE_LINE.sub("", (app / name).read_text("utf-8")) for name in names)


def kernel() -> bytes:
    """Return the compiled kernel, a WebAssembly module."""
    return (files(__package__) / "kernel" / "siren.wasm").read_bytes()
