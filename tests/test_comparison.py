"""The program of benchmarks/cuda/: variant `layered` and the peaks, around the program of a model."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mplicits.codegen.targets.cuda import standalone
from mplicits.model.model_file import load
from support.cuda_host import build, check_error, data, run
from support.fitted_model import fitted_model
from support.nvcc import compile_for
from support.paths import DEMO, ROOT
from support.random_model import random_model

COMPARISON = ROOT / "benchmarks" / "cuda" / "comparison.cu"
SIDE = 20


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program, for the host, around that of a model with bands and a texture, and with small networks."""
    return build(fitted_model(), tmp_path_factory.mktemp("fitted"), COMPARISON)


@pytest.mark.slow
@pytest.mark.parametrize("rounds", ["32", "1"])
def test_layered_takes_the_steps_of_simple(fitted: Path, rounds: str) -> None:
    simple = data(fitted, SIDE, "--variant", "simple", "--schedule", "plain", "--rounds", rounds)
    layered = data(fitted, SIDE, "layered", "--rounds", rounds)
    assert set(np.unique(simple[..., 2])) == {0, 1, 2}
    assert (layered[..., 1:] == simple[..., 1:]).mean(axis=(0, 1)).min() > 0.99, "steps, level, hit"
    seen = (layered[..., 3] > 0.5) & (simple[..., 3] > 0.5)
    assert np.abs(layered - simple)[seen][:, 0].mean() < 1e-4


@pytest.mark.slow
def test_layered_draws_the_picture_of_simple(tmp_path: Path) -> None:
    """A trained model with several hidden layers and a texture."""
    demo = build(load(DEMO), tmp_path, COMPARISON)
    assert run(demo, "--variant", "simple", "--size", str(SIDE), "-o", "want.ppm").returncode == 0
    done = run(demo, "layered", "--size", str(SIDE), "--check", "want.ppm", "--psnr", "30")
    assert (done.returncode, done.stdout[:16]) == (0, "agrees: layered,"), done.stderr


@pytest.mark.slow
def test_layered_times_all_rounds_and_one(fitted: Path) -> None:
    done = run(fitted, "layered", "--benchmark", "--frames", "1", "--size", "9x5", "-o", "b.ppm")
    (size,) = json.loads(done.stdout)["sizes"]
    assert [(row["variant"], row["rounds"] == 1) for row in size["variants"]] == [
        ("layered", False),
        ("layered-one-round", True),
    ]
    assert all({"fps", "milliseconds", "stages", "memory_mib"} <= set(row) for row in size["variants"])
    every, one = (row["executed_tflops"] for row in size["variants"])
    assert every > one > 0
    assert (fitted.parent / "b-layered-9.ppm").exists()


@pytest.mark.slow
def test_peaks_are_measured(fitted: Path) -> None:
    peaks = json.loads(run(fitted, "peaks", "2", "16").stdout)
    assert peaks["peak_mma_tflops"] > 0
    assert peaks["peak_cublas_tflops"] == pytest.approx(2 * 16**3 / 1e-3 / 1e12, rel=1e-3), "frames last 1 ms there"
    assert json.loads(run(fitted, "peaks", "2", "16", NO_CUBLAS="1").stdout)["peak_cublas_tflops"] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "environment", "message"),
    [
        (("layered",), {"NO_CUBLAS": "1"}, "libcublas"),
        (("layered",), {"MAJOR": "7"}, "compute capability 8.0"),
        (("layered", "--variant", "fused"), {}, "leave --variant out"),
        (("peaks", "0", "16"), {}, "ROUNDS 0: from 1"),
    ],
    ids=["cublas", "old", "variant", "rounds"],
)
def test_errors_are_one_line(
    fitted: Path, arguments: tuple[str, ...], environment: dict[str, str], message: str
) -> None:
    check_error(run(fitted, *arguments, **environment), message)


@pytest.mark.slow
def test_nvcc_compiles_it(tmp_path: Path) -> None:
    (tmp_path / "model.cu").write_text(standalone(random_model((16, 1), (32, 0), texture=(16, 0))), encoding="utf-8")
    compile_for("sm_80", tmp_path / "model.cu", COMPARISON)


@pytest.mark.gpu
def test_layered_agrees_on_a_gpu(tmp_path: Path) -> None:
    (tmp_path / "model.cu").write_text(standalone(random_model((32, 0), (64, 0), texture=(16, 0))), encoding="utf-8")
    program = str(compile_for("native", tmp_path / "model.cu", COMPARISON))
    subprocess.run([program, "--variant", "simple", "-o", "want.ppm"], cwd=tmp_path, check=True)
    subprocess.run([program, "layered", "--check", "want.ppm"], cwd=tmp_path, check=True)
