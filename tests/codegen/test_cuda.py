"""The CUDA file's text, and nvcc's opinion of it."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mplicits.codegen.targets import cuda, cuda_cells
from mplicits.codegen.targets.cuda import standalone
from mplicits.codegen.targets.cuda_tables import c_string
from mplicits.model.errors import UserError
from support.golden_text import check_golden
from support.paths import GOLDEN
from support.random_model import random_model
from support.scene_models import SCENE, composed

GOLDEN_TEXT = GOLDEN / "tiny.cuda.cu"
NAME = 'tiny "*/??/\n\\u000a</script>\\'


def compile_for(architecture: str, source: Path) -> None:
    """Compile a CUDA file with all warnings as errors; the program lies beside it, named without the suffix.

    Skips the test where nvcc is missing or does not know the architecture.
    """
    if shutil.which("nvcc") is None:
        pytest.skip("nvcc is not installed (CUDA toolkit)")
    known = subprocess.run(["nvcc", "--list-gpu-code"], capture_output=True, text=True, check=True).stdout.split()
    if architecture != "native" and architecture not in known:
        pytest.skip(f"this nvcc does not know {architecture}")
    flags = ["-O3", f"-arch={architecture}", "-Werror", "all-warnings"]
    command = ["nvcc", *flags, "-o", str(source.with_suffix("")), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_generated_text_is_golden(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The golden text leaves out the hand-written files of codegen/targets/cuda_source/ and glsl/."""
    monkeypatch.setattr(cuda, "_load", lambda name, _seen: f"// {name}\n")
    monkeypatch.setattr(cuda_cells, "COUNT", 4)
    text = standalone(random_model((4, 1), (8, 0), texture=(4, 0), name=NAME), digits=3)
    check_golden(text, GOLDEN_TEXT, request)


def test_a_cube_of_empty_cells_is_one_byte_and_the_others_follow_by_their_bits() -> None:
    grid = np.full((4, 4, 4), 1, np.uint8)
    grid[:2, :2, :2] = [[[0, 9], [0, 0]], [[0, 0], [200, 0]]]
    numbers = cuda_cells.packed(grid)
    codes = b"".join(number.to_bytes(4, "little") for number in numbers)
    assert list(codes[:8]) == [0, 9, 0, 0, 0, 0, 200, 0], "x first, then y, then z"
    assert list(codes[8:]) == [1] * 7 + [0], "seven cubes, and what fills the last number"
    assert cuda_cells.packed(np.full((4, 4, 4), 2, np.uint8)) == [2]


def test_what_moves_has_no_cells() -> None:
    assert "CELL_COUNT = 0;" in standalone(random_model((4, 0), inputs="xyzt"))
    assert "CELL_COUNT = 128;" in standalone(random_model((4, 0)))


@pytest.mark.parametrize("name", [NAME, "\x00\x7f\ud800é漢", "%s%n"])
def test_a_name_stays_in_its_comment_and_its_string(name: str) -> None:
    texts = [standalone(random_model((4, 0), name=given)).splitlines() for given in (name, "plain")]
    different = [pair for pair in zip(*texts, strict=True) if pair[0] != pair[1]]
    assert len(different) == 2
    assert json.dumps(name) in different[0][0]
    assert all(line.isascii() and not line.endswith("\\") for line, _ in different)


def test_a_string_is_escaped_byte_by_byte() -> None:
    assert c_string('a"1\\\n?é') == r'"a\0421\134\012\077\303\251"'


def test_a_storage_that_is_not_there_is_refused() -> None:
    with pytest.raises(UserError, match="one array"):
        standalone(random_model((4, 0)), storage="literal")


def test_every_hand_written_file_is_used() -> None:
    folder = Path(cuda.__file__).parent / "cuda_source"
    text = standalone(random_model((4, 0)))
    for path in folder.glob("*.cuh"):
        last = path.read_text(encoding="utf-8").strip().splitlines()[-3:]
        assert text.count("\n".join(last)) >= 1, path.name
    assert '#include "' not in text


def test_the_head_lists_the_files_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    load, loaded = cuda._load, list[str]()

    def recorded(name: str, seen: set[str]) -> str:
        text = load(name, seen)
        loaded.extend([Path(name).stem] if text else [])
        return text

    monkeypatch.setattr(cuda, "_load", recorded)
    head = standalone(random_model((4, 0))).partition("\n\n")[0].replace("\n// ", " ")
    listed = head.partition("In order: ")[2].partition(".")[0].split(", ")
    assert [name for name in loaded if name in listed] == [
        name for name in listed if name not in {"uniforms", "the field"}
    ]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["shape", "scene"])
def test_nvcc_compiles_a_tiny_model(kind: str, tmp_path: Path) -> None:
    source = tmp_path / "model.cu"
    model = random_model((4, 0), name=NAME) if kind == "shape" else composed(tmp_path, SCENE, widths=(4, 4))
    source.write_text(standalone(model), encoding="utf-8")
    compile_for("sm_90", source)
    if Path("/dev/nvidia0").exists():
        return
    done = subprocess.run([source.with_suffix("")], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), "no device: one line"


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["sm_80", "sm_90", "sm_100"])
def test_nvcc_compiles_every_variant(architecture: str, tmp_path: Path) -> None:
    source = tmp_path / "model.cu"
    model = random_model((64, 2), (128, 2), (256, 2), texture=(64, 1), name=NAME)
    source.write_text(standalone(model), encoding="utf-8")
    compile_for(architecture, source)


@pytest.mark.gpu
@pytest.mark.parametrize("variant", ["fused", "layered"])
def test_a_gpu_draws_what_simple_draws(variant: str, tmp_path: Path) -> None:
    source = tmp_path / "model.cu"
    source.write_text(standalone(random_model((32, 0), (64, 0), texture=(16, 0))), encoding="utf-8")
    compile_for("native", source)
    program = str(source.with_suffix(""))
    subprocess.run([program, "--variant", "simple", "-o", "want.ppm"], cwd=tmp_path, check=True)
    subprocess.run([program, "--variant", variant, "--check", "want.ppm"], cwd=tmp_path, check=True)
