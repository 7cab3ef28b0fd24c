"""Compiles CUDA files by nvcc."""

import subprocess
from pathlib import Path

from support import needs


def compile_for(architecture: str, source: Path, around: Path | None = None) -> Path:
    """Compile a CUDA file with all warnings as errors. Returns the program, beside the file.

    around: compile this file, which includes `source` by its name. Skips the test where nvcc is missing or does not
    know the architecture.
    """
    known = subprocess.run(
        [needs.program("nvcc"), "--list-gpu-code"], capture_output=True, text=True, check=True
    ).stdout.split()
    if architecture != "native" and architecture not in known:
        needs.lack(f"an nvcc that knows {architecture}")
    flags = ["-O3", f"-arch={architecture}", "-Werror", "all-warnings", f"-I{source.parent}"]
    command = ["nvcc", *flags, "-o", str(source.with_suffix("")), str(around or source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return source.with_suffix("")
