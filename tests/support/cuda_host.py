"""Compiles a baked CUDA file for the host, with tests/support/cuda_on_host/ in place of the GPU, and runs it."""

import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.targets.cuda import standalone
from mplicits.model.model import Model
from support import needs

SHIM = Path(__file__).parent / "cuda_on_host"
PROBE = SHIM / "probe.cu"


def build(model: Model, folder: Path, around: Path | None = None) -> Path:
    """Compile the CUDA file of `model` for the host. Returns the program, in `folder`.

    around: compile this file, which includes "model.cu"; PROBE evaluates the networks at points (see `evaluate`). Skips
    the test without g++.
    """
    needs.program("g++")
    source, program = folder / "model.cu", folder / "model"
    source.write_text(standalone(model), encoding="utf-8")
    flags = [
        "-std=c++17",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wno-unknown-pragmas",
        "-Wno-unused-parameter",
        "-Wno-parentheses",  # glsl/ has && inside || without them
        "-DMPLICITS_HOST",
        f"-I{folder}",
        f"-I{SHIM}",
        "-x",
        "c++",
    ]
    subprocess.run(["g++", *flags, str(around or source), "-o", str(program)], check=True)
    return program


def run(program: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the program in its folder.

    environment: properties of the GPU, by the variables MPLICITS_HOST_* of cuda_runtime.h and dlfcn.h without prefix.
    """
    settings = {f"MPLICITS_HOST_{name}": value for name, value in environment.items()}
    return subprocess.run(
        [str(program), *arguments], cwd=program.parent, env=settings, capture_output=True, text=True, check=False
    )


def check_error(done: subprocess.CompletedProcess[str], message: str) -> None:
    """Check that a run failed in one line with a message."""
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert message in done.stderr


def data(program: Path, side: int, *arguments: str) -> NDArray[np.float32]:
    """Draw `--shade data`: (side, side, 4) float32, (t, steps, level, hit) of each pixel, top row first."""
    done = run(program, *arguments, "--size", str(side), "--shade", "data", "-o", "data.f32")
    assert done.returncode == 0, done.stderr
    return np.fromfile(program.parent / "data.f32", np.float32).reshape(side, side, 4)


def evaluate(program: Path, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Run a probe at points (N, 4) float32, N a multiple of 128. Returns the rows of probe.cu, (rows, N, 4)."""
    done = subprocess.run([str(program)], input=points.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.float32).reshape(-1, len(points), 4)
