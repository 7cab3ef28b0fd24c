"""The text of the CUDA file; nvcc compiles it, and a GPU draws with it."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mplicits.codegen.targets import cuda, cuda_cells
from mplicits.codegen.targets.cuda import standalone
from mplicits.model.errors import UserError
from support.golden_text import check_golden
from support.nvcc import compile_for
from support.paths import GOLDEN
from support.random_model import random_model
from support.scene_models import SCENE, composed

GOLDEN_TEXT = GOLDEN / "tiny.cuda.cu"
NAME = 'tiny "*/??/\n\\u000a</script>\\'


def test_the_text_equals_the_golden_file(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The golden text has no hand-written files (codegen/targets/cuda_source/, glsl/)."""
    monkeypatch.setattr(cuda, "_load", lambda name, _seen: f"// {name}\n")
    monkeypatch.setattr(cuda_cells, "COUNT", 4)
    text = standalone(random_model((4, 1), (8, 0), texture=(4, 0), name=NAME), digits=3)
    check_golden(text, GOLDEN_TEXT, request)


def test_cells_are_packed_in_morton_order_and_an_empty_cube_is_one_byte() -> None:
    grid = np.full((4, 4, 4), 1, np.uint8)
    grid[:2, :2, :2] = [[[0, 9], [0, 0]], [[0, 0], [200, 0]]]
    numbers = cuda_cells.packed(grid)
    codes = b"".join(number.to_bytes(4, "little") for number in numbers)
    assert list(codes[:8]) == [0, 9, 0, 0, 0, 0, 200, 0], "x first, then y, then z"
    assert list(codes[8:]) == [1] * 7 + [0], "seven cubes, and padding"
    assert cuda_cells.packed(np.full((4, 4, 4), 2, np.uint8)) == [2]


def test_a_moving_model_has_no_cells() -> None:
    assert "CELL_COUNT = 0;" in standalone(random_model((4, 0), inputs="xyzt"))
    assert "CELL_COUNT = 128;" in standalone(random_model((4, 0)))


def test_a_model_name_stays_in_its_comment_and_its_string() -> None:
    name = "\x00\x7f\ud800é漢 %s%n " + NAME
    texts = [standalone(random_model((4, 0), name=title)).splitlines() for title in (name, "plain")]
    different = [pair for pair in zip(*texts, strict=True) if pair[0] != pair[1]]
    assert len(different) == 2
    assert json.dumps(name) in different[0][0]
    assert all(line.isascii() and not line.endswith("\\") for line, _ in different)


def test_an_unknown_storage_is_refused() -> None:
    with pytest.raises(UserError, match="one array"):
        standalone(random_model((4, 0)), storage="literal")


def test_the_text_includes_every_hand_written_file() -> None:
    folder = Path(cuda.__file__).parent / "cuda_source"
    text = standalone(random_model((4, 0)))
    for path in folder.glob("*.cuh"):
        last = path.read_text(encoding="utf-8").strip().splitlines()[-3:]
        assert text.count("\n".join(last)) >= 1, path.name
    assert '#include "' not in text


@pytest.fixture(scope="module", params=["shape", "scene"])
def tiny_program(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program that nvcc compiled from a tiny model."""
    folder = tmp_path_factory.mktemp(request.param)
    shape = request.param == "shape"
    model = random_model((4, 0), name=NAME) if shape else composed(folder, SCENE, widths=(4, 4))
    (folder / "model.cu").write_text(standalone(model), encoding="utf-8")
    return compile_for("sm_90", folder / "model.cu")


@pytest.mark.slow
def test_nvcc_compiles_a_tiny_model(tiny_program: Path) -> None:
    done = subprocess.run([tiny_program, "--help"], capture_output=True, text=True, check=True)
    assert "--variant simple|fused]" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(Path("/dev/nvidia0").exists(), reason="needs a machine without a GPU")
def test_without_a_gpu_the_program_prints_one_line(tiny_program: Path) -> None:
    done = subprocess.run([tiny_program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "no CUDA device" in done.stderr or "no NVIDIA driver" in done.stderr


@pytest.mark.slow
def test_nvcc_compiles_every_variant(tmp_path: Path) -> None:
    source = tmp_path / "model.cu"
    model = random_model((64, 2), (128, 2), (256, 2), texture=(64, 1), name=NAME)
    source.write_text(standalone(model), encoding="utf-8")
    compile_for("sm_80", source)


@pytest.mark.gpu
def test_variants_agree_on_a_gpu(tmp_path: Path) -> None:
    source = tmp_path / "model.cu"
    source.write_text(standalone(random_model((32, 0), (64, 0), texture=(16, 0))), encoding="utf-8")
    program = str(compile_for("native", source))
    subprocess.run([program, "--variant", "simple", "-o", "want.ppm"], cwd=tmp_path, check=True)
    subprocess.run([program, "--variant", "fused", "--check", "want.ppm"], cwd=tmp_path, check=True)
