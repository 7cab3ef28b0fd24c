"""The studio: the page of a model, extended by the training of dropped meshes. Its scripts are in app/."""

import base64
import re
from dataclasses import asdict
from importlib.resources import files

from ..model.gallery import FOLDER, SUFFIX
from ..model.model_file import load
from ..trainer.config import TrainingConfig, default_config
from ..trainer.settings import DEFAULT_PRESET, PRESETS, networks, omegas
from ..web.page import Extension, standalone

WORKER = (
    *("training_error.js", "kernel.js", "batches.js", "tree.js", "winding.js", "shape.js", "sampling.js", "worker.js"),
)
"""Modules of the workers' script, in its order."""
MESHES = ("mesh_parts.js", "obj.js", "ply.js", "stl.js", "glb.js", "mesh_file.js")
"""Modules that read mesh files, in their order."""
TRAINER = (
    *("training_error.js", "kernel.js", "batches.js", "optimizer.js", "team.js", "fit.js", "training.js"),
    "model_file.js",
)
"""Modules of the page that train a model, in their order."""
STUDIO = (*MESHES, *TRAINER, "live.js", "studio.js")
"""Modules that extend the page of a model, in their order."""
FIRST_MODEL = "bob-small"
"""Model of the gallery that the page shows before a mesh."""
STEPS = (1000, 2500)
"""Optimizer steps of each level."""

_MODULE_LINE = re.compile(r"^import [^;]*;\n|^export (?=\w)", re.MULTILINE)


def studio(
    levels: str = PRESETS[DEFAULT_PRESET].levels, steps: tuple[int, ...] = STEPS, config: TrainingConfig | None = None
) -> str:
    """Return the text of the page.

    levels: in the form of --levels. steps: optimizer steps of each level. config: the hyperparameters of a training.
    """
    sizes = networks(levels)
    layouts = [{"width": width, "depth": depth} for width, depth in sizes]
    settings = {"levels": layouts, "omegas": omegas(None, sizes), "steps": steps, "seed": 0}
    data = {"worker": script(WORKER), "kernel": base64.b64encode(kernel()).decode()}
    return standalone(
        load(FOLDER / f"{FIRST_MODEL}{SUFFIX}"),
        shade="phong",
        extension=Extension(
            scripts=script(STUDIO),
            stage=_read("studio.html"),
            css=_read("studio.css"),
            elements="".join(f'<script type="text/plain" id="{name}">{text}</script>\n' for name, text in data.items()),
            facts={"studio": {"settings": settings, "config": asdict(config or default_config())}},
            policy=" 'wasm-unsafe-eval'; worker-src blob:",
            accept=".obj,.ply,.stl,.glb,.safetensors",
            open="Open a file",
            hint="Drop a mesh or a .safetensors model anywhere.",
        ),
    )


def script(names: tuple[str, ...]) -> str:
    """Join modules of app/ into one script, without their imports and exports."""
    return "".join(_MODULE_LINE.sub("", _read(name)) for name in names)


def kernel() -> bytes:
    """Return the compiled kernel, a WebAssembly module."""
    return (files(__package__) / "kernel" / "siren.wasm").read_bytes()


def _read(name: str) -> str:
    return (files(__package__) / "app" / name).read_text("utf-8")
