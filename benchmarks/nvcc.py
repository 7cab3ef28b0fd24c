"""What the scripts beside it share: bake a model to CUDA, compile the file, and run its benchmark."""

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
"""What a table's cells say on a machine without a GPU."""


@dataclass(frozen=True)
class Built:
    """A CUDA program that was compiled here."""

    program: Path
    """The executable file, in a folder of its own."""
    seconds: float
    """Time that nvcc took."""

    def benchmark(self, *arguments: str) -> dict[str, Any]:
        """Run `--benchmark` with more arguments, and return the JSON that it prints.

        The last frames are written beside the program. Raises CalledProcessError where it fails.
        """
        done = subprocess.run(
            [str(self.program), "--benchmark", *arguments],
            cwd=self.program.parent,
            text=True,
            stdout=subprocess.PIPE,
            check=True,
        )
        report: dict[str, Any] = json.loads(done.stdout)
        return report


def gpu() -> str | None:
    """Return the name of the GPU and the version of its driver, or None where there is no GPU or no nvcc."""
    if shutil.which("nvidia-smi") is None or shutil.which("nvcc") is None:
        return None
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    done = subprocess.run(query, capture_output=True, text=True, check=False)
    return done.stdout.splitlines()[0] if done.returncode == 0 and done.stdout.strip() else None


def build(model: Model, folder: Path) -> Built:
    """Compile `model` for the GPU of this machine, in `folder`, which is made. Raises CalledProcessError."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "model.cu"
    source.write_text(standalone(model), encoding="utf-8")
    began = time.perf_counter()
    subprocess.run(["nvcc", "-O3", "-arch=native", "-o", str(folder / "model"), str(source)], check=True)
    return Built(folder / "model", time.perf_counter() - began)
