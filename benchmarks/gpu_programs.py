"""The CUDA programs that the stages of on_gpu.py run: compiled by pack_for_gpu.py, or else on the machine.

Each is cuda/comparison.cu around what `mplicits bake` writes.
"""

import gzip
import hashlib
import os
from pathlib import Path

from gpu_commands import MPLICITS, PACK, REHEARSAL, ROOT, run
from table2 import MODELS_OF

CHECKED = ("spot", "three", "spot-large")
"""Models whose CUDA programs are compared with a reference picture."""
PROGRAMS = tuple(dict.fromkeys((*CHECKED, *MODELS_OF)))
"""Models whose CUDA programs are drawn or timed."""
COMPARISON = ROOT / "benchmarks" / "cuda" / "comparison.cu"
SOURCES = ("benchmarks/cuda", "codegen", "field", "glsl", "ir", "model")
"""Folders whose code decides what a program does."""


def model_of(name: str) -> str:
    """Return the file of a model of Table 2, or the name of a model of the gallery."""
    return str(PACK / "models" / f"{name}.safetensors") if name in MODELS_OF else name


def bake(name: str, source: Path) -> None:
    """Write the CUDA source of a model. Ends the process where that fails."""
    run(*MPLICITS, "bake", model_of(name), "--target=cuda", "--force", "-o", source, check=True)


def compile_for(arch: str, source: Path, program: Path) -> None:
    """Compile a program around a CUDA source, which is named model.cu. Ends the process where that fails."""
    compiler = ["nvcc", "-O3", f"-arch={arch}"]
    if REHEARSAL:
        shim = ROOT / "tests" / "support" / "cuda_on_host"
        compiler = ["g++", "-std=c++17", "-O1", "-w", "-DMPLICITS_HOST", f"-I{shim}", "-x", "c++"]
    run(*compiler, f"-I{source.parent}", COMPARISON, "-o", program, check=True)


def packed_of(name: str, arch: str) -> Path:
    """Return where the pack has a model's program for an architecture; the name changes with the model and our code.

    It is not of the CUDA source: another version of NumPy may round a number of it otherwise.
    """
    from mplicits.model.gallery import model_path

    paths = [
        path for room in SOURCES for path in (ROOT / room).rglob("*") if path.suffix in (".py", ".cu", ".cuh", ".glsl")
    ]
    digest = hashlib.sha256(model_path(model_of(name)).read_bytes())
    for path in sorted(paths):
        digest.update(path.read_bytes())
    return PACK / "programs" / name / f"{arch}-{digest.hexdigest()[:16]}.gz"


def program_of(name: str) -> Path:
    """Return where the CUDA program of a model is, or will be."""
    return Path(os.environ["MPLICITS_PROGRAMS"], name, "model")


def is_built(name: str) -> bool:
    """Whether the CUDA program of a model is there."""
    return program_of(name).exists()


def build(name: str) -> Path:
    """Unpack or compile the CUDA program of a model, unless it is there. Ends the process where that fails."""
    program = program_of(name)
    if not is_built(name):
        program.parent.mkdir(parents=True, exist_ok=True)
        source, built, packed = program.with_suffix(".cu"), program.with_suffix(".new"), packed_of(name, "*")
        if REHEARSAL or not any(unpacked(one, built) for one in packed.parent.glob(packed.name)):
            bake(name, source)
            compile_for("native", source, built)
        built.rename(program)
    return program


def unpacked(packed: Path, program: Path) -> bool:
    """Unpack a program of the pack. Returns whether it draws: it may be for another card."""
    program.write_bytes(gzip.decompress(packed.read_bytes()))
    program.chmod(0o755)
    return run(program, "--size", 16, "--variant", "simple", "-o", program.with_suffix(".ppm")).returncode == 0
