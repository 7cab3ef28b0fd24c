"""The studio: the page of a model, extended by the training of dropped meshes. Its scripts are in app/."""

import base64
import re
from dataclasses import asdict
from importlib.resources import files
from typing import Any

from .. import glsl
from ..codegen.printers.field import plain_color
from ..model.gallery import FOLDER, SUFFIX
from ..model.model_file import load
from ..model.orientation import UPRIGHT
from ..trainer.config import TrainingConfig, default_config
from ..trainer.settings import DEFAULT_PRESET, PRESETS
from ..web.page import TEXTS, Extension, standalone, text_elements, text_facts
from ..web.page import script as web_script

MESHES = ("mesh_parts.js", "obj.js", "ply.js", "stl.js", "glb.js", "mesh_file.js", "input.js", "corners.js")
"""Modules that read shapes, in their order."""
WORKER = (
    *MESHES,
    *("training_error.js", "kernel.js", "batches.js", "tree.js", "winding.js", "shape.js", "sampling.js"),
    *("tracing.js", "marching.js", "isosurface.js", "field_mesh.js", "mesh_writer.js", "examples.js"),
    *("worker.js",),
)
"""Modules of the workers' script, in its order."""
TRAINER = (
    *("training_error.js", "kernel.js", "batches.js", "optimizer.js", "team.js", "plan.js", "fit.js", "training.js"),
    *("orientation.js", "model_file.js"),
)
"""Modules of the page that train a model, in their order."""
STUDIO = (
    *TRAINER,
    *("settings.js", "live.js", "preview.js", "axes.js", "storage.js", "webm.js", "recorder.js", "exports.js"),
    *("folder.js", "studio.js"),
)
"""Modules that extend the page of a model, in their order."""
FIRST_MODEL = "bob-small"
"""Model of the gallery that the page shows before a mesh."""
LABELS = {"tiny": "Tiny · Shadertoy 5 kB", "small": "Small · 18 kB", "base": "Base · 60 kB"}
"""Presets of `train` that the page offers, with the bytes of their Shadertoy texts."""
SECONDS = {"tiny": 10, "small": 30, "base": 60}
"""Default seconds of a training."""
LIMITS = {"width": 256, "depth": 7, "levels": 8}
"""Limits of levels; the kernel's arrays hold 8 layers of sines."""

_MODULE_LINE = re.compile(r"^import [^;]*;\n|^export (?=\w)", re.MULTILINE)


def studio(config: TrainingConfig | None = None, fixed: dict[str, Any] | None = None) -> str:
    """Return the text of the page.

    config: the hyperparameters of a training. fixed: settings of every training (trainShape in app/training.js), in
    place of the visitor's, for tests.
    """
    data = {"worker": script(WORKER), "kernel": base64.b64encode(kernel()).decode()}
    shaders = {name: glsl.read(name) for name in ("preview.vert.glsl", "preview.glsl")}
    elements = [f'<script type="text/plain" id="{name}">{text}</script>\n' for name, text in (data | shaders).items()]
    return standalone(
        load(FOLDER / f"{FIRST_MODEL}{SUFFIX}"),
        shade="phong",
        extension=Extension(
            scripts=web_script(TEXTS) + script(STUDIO),
            stage=_read("studio.html"),
            css=_read("studio.css"),
            elements=_read("bar.html") + text_elements() + "".join(elements),
            facts=text_facts() | {"studio": page_facts(config) | {"fixed": fixed}},
            policy=" 'wasm-unsafe-eval'; worker-src blob:",
            accept=".obj,.mtl,.png,.jpg,.jpeg,.ply,.stl,.glb,.xyz,.safetensors",
            open="Open a file",
            hint="Drop a mesh, a point cloud or a .safetensors model anywhere.",
        ),
    )


def page_facts(config: TrainingConfig | None = None) -> dict[str, Any]:
    """Return the facts of the studio, `facts.studio` in app/."""
    config = config or default_config()
    lengths = config.lengths
    presets = {
        name: {"label": label, "levels": PRESETS[name].levels, "packed": PRESETS[name].packed, "seconds": SECONDS[name]}
        for name, label in LABELS.items()
    }
    return {
        "config": asdict(config),
        "presets": presets,
        "preset": DEFAULT_PRESET,
        "omegas": lengths.omegas,
        "omega_width": lengths.omega_width,
        "texture": [*lengths.texture_network, lengths.texture_omega],
        "limits": LIMITS,
        "upright": UPRIGHT,
        "plain": plain_color(),
    }


def script(names: tuple[str, ...]) -> str:
    """Join modules of app/ into one script, without their imports and exports."""
    return "".join(_MODULE_LINE.sub("", _read(name)) for name in names)


def kernel() -> bytes:
    """Return the compiled kernel, a WebAssembly module."""
    return (files(__package__) / "kernel" / "siren.wasm").read_bytes()


def _read(name: str) -> str:
    return (files(__package__) / "app" / name).read_text("utf-8")
