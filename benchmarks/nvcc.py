"""Bakes a model to CUDA, compiles and benchmarks it. Imported by the scripts beside it."""

import json
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mplicits.codegen.targets.cuda import standalone
from mplicits.model.model import Model

NOT_RUN = "not run on a GPU"


@dataclass(frozen=True)
class Built:
    """A compiled program, and the seconds that nvcc took."""

    program: Path
    seconds: float

    def benchmark(self, *arguments: str) -> dict[str, Any]:
        """What `--benchmark` prints; frames lie beside the program."""
        done = subprocess.run(
            [str(self.program), "--benchmark", *arguments],
            cwd=self.program.parent,
            text=True,
            stdout=subprocess.PIPE,
            check=True,
        )
        found: dict[str, Any] = json.loads(done.stdout)
        return found


def gpu() -> str | None:
    """Card and driver, or None where there is no GPU or no nvcc."""
    if shutil.which("nvidia-smi") is None or shutil.which("nvcc") is None:
        return None
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    done = subprocess.run(query, capture_output=True, text=True, check=False)
    return done.stdout.splitlines()[0] if done.returncode == 0 and done.stdout.strip() else None


def build(model: Model, folder: Path) -> Built:
    """Compiles `model` for the GPU of this machine."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "model.cu"
    source.write_text(standalone(model), encoding="utf-8")
    began = time.perf_counter()
    subprocess.run(["nvcc", "-O3", "-arch=native", "-o", str(folder / "model"), str(source)], check=True)
    return Built(folder / "model", time.perf_counter() - began)
