"""Builds a baked CUDA file for the host, where tests/support/cuda_on_host/ stands for the GPU."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mplicits.codegen.targets.cuda import standalone
from mplicits.model.model import Model
from numpy.typing import NDArray

SHIM = Path(__file__).parent / "cuda_on_host"


def build(model: Model, folder: Path, probe: bool = False) -> Path:
    """The program of `model`, or the one that evaluates its networks at points (probe.cu)."""
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed")
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
        "-DMPLICITS_HOST",
        f'-DMODEL_FILE="{source}"',
        f"-I{SHIM}",
        "-x",
        "c++",
    ]
    main = SHIM / "probe.cu" if probe else source
    subprocess.run(["g++", *flags, str(main), "-o", str(program)], check=True)
    return program


def run(program: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """The program with `arguments`, in its folder; `environment`: MPLICITS_HOST_* of the GPU that it finds."""
    settings = {f"MPLICITS_HOST_{name}": value for name, value in environment.items()}
    return subprocess.run(
        [str(program), *arguments], cwd=program.parent, env=settings, capture_output=True, text=True, check=False
    )


def data(program: Path, variant: str, side: int, *arguments: str) -> NDArray[np.float32]:
    """(side, side, 4): t, steps, level, hit, top row first."""
    done = run(program, "--variant", variant, "--size", str(side), "--shade", "data", "-o", "data.f32", *arguments)
    assert done.returncode == 0, done.stderr
    return np.fromfile(program.parent / "data.f32", np.float32).reshape(side, side, 4)


def evaluate(program: Path, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """What a probe prints at points (N, 4), N a multiple of 128: (rows, N, 4)."""
    done = subprocess.run([str(program)], input=points.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.float32).reshape(-1, len(points), 4)
