"""The studio: the page of a model, extended by the training of dropped meshes. Its HTML is in stage/."""

import re
from dataclasses import asdict, fields
from importlib.resources import files
from typing import Any

from .. import glsl
from ..codegen.printers.field import plain_color
from ..codegen.targets.baked import Baked
from ..model.endings import IN_PAGE
from ..model.model import Model
from ..model.orientation import UPRIGHT
from ..trainer.config import LossWeights, TrainingConfig, default_config
from ..trainer.options import CREASE
from ..trainer.settings import DEFAULT_PRESET, PRESETS
from . import page, tiny_page
from .bundle import modules, read, script
from .document import ENTRY, SHADER, Element, Studio, packed
from .minified import short_script, short_shader
from .spaces import squeezed

TITLE = "mplicits studio"
LABELS = {"tiny": "Tiny 6+ kB", "small": "Small 17+ kB", "base": "Base 60+ kB"}
"""Presets of `train` that the page offers, with the sizes of their Shadertoy texts without colors."""
SECONDS = {"tiny": 10, "small": 30, "base": 60}
"""Default seconds of a training."""
CONFIG = ("loss", "step", "sampling", "mining", "texture", "measuring", "budget", "bend")
"""Parts of `TrainingConfig` of which the page reads something."""
COMPANIONS = (".mtl", ".bin", ".png", ".jpg", ".jpeg", ".webp")
"""Endings of the files that a mesh may name."""
LIMITS = {"width": 256, "depth": 7, "levels": 8}
"""Limits of levels; the kernel's arrays hold 8 layers of sines."""


def studio(config: TrainingConfig | None = None, fixed: dict[str, Any] | None = None) -> str:
    """Return the text of the page without a model.

    config: the hyperparameters of a training. fixed: settings of every training (trainShape in train/training.js), in
    place of the visitor's, for tests.
    """
    return packed(page.empty_page(TITLE, "phong", parts(config, fixed))).text


def baked(model: Model, **options: Any) -> Baked:
    """Return a model's page that also trains; its weights are exact. options: of `page.page_of`. Raises UserError."""
    return page.baked(model, studio=parts(), **options)


def parts(config: TrainingConfig | None = None, fixed: dict[str, Any] | None = None) -> Studio:
    """Return what the page has beyond that of a model. config, fixed: see `studio`."""
    policy, viewer = " 'wasm-unsafe-eval'; worker-src blob:", Studio()
    of_viewer = {"policy": policy} | {key: getattr(viewer, key) for key in ("accept", "open", "hint", "description")}
    return Studio(
        modules=_further_modules(),
        stage=read("stage/studio.html"),
        style=read("stage/studio.css"),
        bar=read("stage/bar.html"),
        elements=(
            Element("worker", "text/x-worker", squeezed(short_script(script(modules("worker.js"))))),
            Element("step.wgsl", "x-shader/x-compute", short_shader(read("kernel/step.wgsl"))),
            *(Element(name, SHADER, short_shader(glsl.read(name))) for name in ("preview.vert.glsl", "preview.glsl")),
            Element("kernel", "application/octet-stream", kernel()),
        ),
        facts=page.text_facts()
        | {"studio": page_facts(config, fixed) | {"viewer": of_viewer, "tiny": tiny_page.page_facts()}},
        policy=policy,
        accept=",".join((*IN_PAGE, *COMPANIONS, ".safetensors")),
        open="Open a file",
        hint="Drop a mesh, a point cloud or a .safetensors model anywhere.",
        description="Drop a mesh or a point cloud: it trains in the browser to a small neural distance function.",
    )


def _further_modules() -> tuple[str, ...]:
    """Return the modules of the studio that the page of a model has not."""
    known = modules(ENTRY)
    return tuple(name for name in modules("studio.js") if name not in known)


def page_facts(config: TrainingConfig | None = None, fixed: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the facts of the studio, `facts.studio` in the scripts. config, fixed: see `studio`."""
    config = config or default_config()
    words = set(re.findall(r"\w+", short_script(script((*modules("worker.js"), *_further_modules())))))
    if missing := [each.name for each in fields(LossWeights) if each.name not in words]:
        raise ValueError(f"the page has no loss weight {missing[0]}; add it to siren.c, step.wgsl and kernel.js")
    lengths = config.lengths
    presets = {
        name: {"label": label, "levels": PRESETS[name].levels, "packed": PRESETS[name].packed, "seconds": SECONDS[name]}
        for name, label in LABELS.items()
    }
    return {
        "config": _named({name: asdict(getattr(config, name)) for name in CONFIG}, words),
        "presets": presets,
        "preset": DEFAULT_PRESET,
        "crease": CREASE,
        "fixed": fixed and {"crease": CREASE} | fixed,
        "omegas": lengths.omegas,
        "omega_width": lengths.omega_width,
        "texture": [*lengths.texture_network, lengths.texture_omega],
        "limits": LIMITS,
        "upright": UPRIGHT,
        "endings": IN_PAGE,
        "plain": plain_color(),
    }


def _named(values: dict[str, Any], words: set[str]) -> dict[str, Any]:
    """Return the values, at any depth, whose keys are among words."""
    return {
        key: _named(value, words) if isinstance(value, dict) else value for key, value in values.items() if key in words
    }


def kernel() -> bytes:
    """Return the compiled kernel, a WebAssembly module."""
    return (files(__package__) / "kernel" / "siren.wasm").read_bytes()
