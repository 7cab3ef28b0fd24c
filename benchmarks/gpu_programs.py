"""The CUDA programs that the stages of on_gpu.py run."""

import os
from pathlib import Path

from gpu_commands import MPLICITS, PACK, REHEARSAL, ROOT, run
from table2 import MODELS_OF

CHECKED = ("spot", "three", "spot-large")
"""Models whose CUDA programs are compared with a reference picture."""


def model_of(name: str) -> str:
    """Return the file of a model of Table 2, or the name of a model of the gallery."""
    return str(PACK / "models" / f"{name}.safetensors") if name in MODELS_OF else name


def program_of(name: str) -> Path:
    """Return where the CUDA program of a model is, or will be."""
    return Path(os.environ["MPLICITS_PROGRAMS"], name, "model")


def is_built(name: str) -> bool:
    """Whether the CUDA program of a model is there."""
    return program_of(name).exists()


def build(name: str) -> Path:
    """Bake and compile the CUDA program of a model, unless it is there. Ends the process where that fails."""
    program = program_of(name)
    if not is_built(name):
        program.parent.mkdir(parents=True, exist_ok=True)
        source, compiled = program.with_suffix(".cu"), program.with_suffix(".new")
        run(*MPLICITS, "bake", model_of(name), "--target=cuda", "--force", "-o", source, check=True)
        command = ["nvcc", "-O3", "-arch=native"]
        if REHEARSAL:
            shim = ROOT / "tests" / "support" / "cuda_on_host"
            command = ["g++", "-std=c++17", "-O1", "-w", "-DMPLICITS_HOST", f"-I{shim}", "-x", "c++"]
        run(*command, source, "-o", compiled, check=True)
        compiled.rename(program)
    return program
