"""Damaged files and odd command lines end in one line, or work; never in a traceback, a crash or a hang.

Some 500 cases with a seed that stays the same; the slow test takes a new seed, and prints it. MPLICITS_FUZZ_SEED takes
one of these again. A case that failed is kept in tests/fuzz/cases, and tried from then on.
"""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import numpy as np
import pytest
import torch
import trimesh

from mplicits import cli
from mplicits.bake.registry import TARGETS
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model_file import load, save, to_bytes
from mplicits.scenes.compose import compose
from mplicits.trainer.checkpoint import CheckpointFile
from mplicits.trainer.import_authors import read_network
from mplicits.trainer.shapes.load import load_shape
from support.fuzzing import Case, damaged, damaged_model, fresh_seed, survive
from support.packed_model import packed_model
from support.random_model import random_model
from support.scene_models import SCENE

CASES = Path(__file__).parent / "cases"
POINTS = np.random.default_rng(0).uniform(-1, 1, (20, 3))
SHAPES = [f"ball.{ending}" for ending in ("ply", "obj", "stl", "glb")] + ["ascii.ply"]
CLOUDS = ["cloud.ply", "cloud.xyz", "cloud.npz", "bare.xyz"]
OPTIONS = (
    "-o --seed --steps --seconds --levels --omega --size --camera --level --target --digits --resolution --texture "
    "--noise --thicken --crease --weights --up --front --json --resume --quiet --packed"
)
FAST, MANY = 1, 20
"""Cases, times the numbers of `KINDS`."""


@pytest.fixture(autouse=True)
def few_targets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `info` measure the targets whose texts are fast to write."""
    fast = {name: TARGETS[name] for name in ("shadertoy", "wgsl", "c", "python")}
    monkeypatch.setattr("mplicits.bake.facts.TARGETS", fast)


def use_model(path: Path) -> None:
    model = load(path)
    if len(model.inputs) == 3:
        interpret.field(lower(model), POINTS.astype(np.float32), len(model.levels))
    assert cli.main(["info", str(path)]) == 0


def use_scene(path: Path) -> None:
    lower(compose(path))


def use_shape(path: Path) -> None:
    shape, _ = load_shape(str(path), crease=30.0)
    shape.surface(50, np.random.default_rng(0), colors=True)
    shape.distance(POINTS)


def use_part(path: Path) -> None:
    part = CheckpointFile(path.with_name(path.name.replace(".part", "")), print)
    if part.is_there():
        part.read()


def use_command(path: Path) -> None:
    code = cli.main(path.read_text().split("\n"))
    assert code in (0, 2), code


KINDS: dict[str, tuple[Callable[[Path], None], int]] = {
    "model": (use_model, 130),
    "packed": (use_model, 60),
    "shape": (use_shape, 180),
    "checkpoint": (lambda path: void(read_network(path, None)), 60),
    "part": (use_part, 40),
    "command": (use_command, 90),
    "scene": (use_scene, 40),
}
"""What is done with a case of a kind, and how many of them the fast test takes."""


def void(_: object) -> None:
    """Take what a function returns."""


def shape_files(folder: Path) -> list[Case]:
    """Small shapes in every format."""
    mesh = trimesh.creation.icosphere(1)
    mesh.visual.vertex_colors = np.uint8(127 + 127 * mesh.vertices)
    points = trimesh.creation.icosphere(2).vertices
    for name in SHAPES:
        mesh.export(folder / name, **({"encoding": "ascii"} if name.startswith("ascii") else {}))
    columns = np.concatenate((points, points, 127 + 127 * points), axis=1)
    head = "ply\nformat ascii 1.0\nelement vertex 162\n" + "".join(
        f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "red", "green", "blue")
    )
    shares = np.concatenate((points, points, 0.5 + 0.5 * points), axis=1)
    np.savetxt(folder / "cloud.ply", shares, "%.5f", header=head + "end_header", comments="")
    np.savetxt(folder / "cloud.xyz", columns, "%.5f")
    np.savetxt(folder / "bare.xyz", points, "%.5f")
    np.savez(folder / "cloud.npz", points=points, normals=points)
    return [(name, (folder / name).read_bytes()) for name in SHAPES + CLOUDS]


def checkpoint_file(folder: Path) -> list[Case]:
    state = {f"net.{i}.0.{kind}": torch.ones(shape) for i, kind, shape in _layers()}
    torch.save(state, folder / "c.pth")
    return [("c.pth", (folder / "c.pth").read_bytes())]


def _layers() -> Iterator[tuple[int, str, tuple[int, ...]]]:
    for i, (rows, columns) in enumerate(((8, 3), (8, 8), (1, 8))):
        yield i, "weight", (rows, columns)
        yield i, "bias", (rows,)


def part_file(folder: Path) -> list[Case]:
    save(random_model((4, 0)), folder / "m.part.safetensors", ('{"steps": 3}', {"weight.0": np.ones((4, 3), "f4")}))
    return [("m.part.safetensors", (folder / "m.part.safetensors").read_bytes())]


def packed_file(folder: Path) -> list[Case]:
    return [("m.safetensors", to_bytes(packed_model(random_model((4, 1), (4, 0), texture=(4, 0)))))]


def scene_file(folder: Path) -> list[Case]:
    text = SCENE.replace("ball.safetensors", "spot-small").replace("coarse.safetensors", "bob-small")
    return [("s.toml", text.encode())]


def command(random: Random) -> bytes:
    """A command line, an argument a line, that names no file that is there."""
    verb = random.choice(("train", "render", "bake", "mesh", "info", "eval", "import", "report", "trian", ""))
    words = ["missing.ply", "missing.safetensors", *OPTIONS.split()]
    values = [
        "",
        "🎈",
        "x" * 4000,
        *["nan", "-1", "0", "1e999", "64x1", "0x0", "99999999999999999999", "a,b", "none", "-"],
    ]
    return "\n".join([verb, *random.choices(words + values, k=random.randint(0, 6))]).encode()


def cases(kind: str, count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Make the damaged files of a kind."""
    random = Random(f"{kind} {seed}")
    makers = {"packed": packed_file, "shape": shape_files, "part": part_file, "scene": scene_file}
    make = (makers | {"checkpoint": checkpoint_file}).get(kind)
    whole = make(folder) if make else [("m.safetensors", to_bytes(random_model((4, 1), (4, 0), texture=(4, 0))))]
    for number in range(count):
        name, data = random.choice(whole)
        if kind == "command":
            yield f"{kind}-{seed}-{number}.txt", command(random)
            continue
        spoil = damaged_model if name.endswith("safetensors") else damaged
        yield f"{kind}-{seed}-{number}{name[name.index('.') :]}", spoil(data, random)


@pytest.mark.parametrize("kind", KINDS)
def test_damage_ends_in_one_line(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    use, count = KINDS[kind]
    assert survive(cases(kind, FAST * count, 0, tmp_path), use, tmp_path, CASES) == []


def test_what_failed_once_does_not_fail_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for kind, (use, _) in KINDS.items():
        kept = [(path.name, path.read_bytes()) for path in sorted(CASES.glob(f"{kind}-*"))]
        assert survive(kept, use, tmp_path, CASES) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_fresh_damage_ends_in_one_line(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    seed = fresh_seed()
    use, count = KINDS[kind]
    found = survive(cases(kind, MANY * count, seed, tmp_path), use, tmp_path, CASES)
    assert found == [], f"seed {seed}"


def test_a_case_that_brings_its_process_down_is_kept_and_the_rest_goes_on(tmp_path: Path) -> None:
    def use(path: Path) -> None:
        data = path.read_bytes()
        if data == b"crash":
            os.abort()
        if data == b"bug":
            raise IndexError
        if data == b"lines":
            raise UserError("one\ntwo")
        if data == b"memory":
            bytearray(1 << 40)
        raise UserError("refused")

    names = ("fine", "crash", "fine", "bug", "lines", "memory", "fine")
    listed = [(f"{i}.txt", name.encode()) for i, name in enumerate(names)]
    found = survive(listed, use, tmp_path, tmp_path / "kept")
    assert [line.removeprefix(f"{tmp_path}/kept/").partition(" in ")[0] for line in found] == [
        "1.txt: ended by SIGABRT",
        "3.txt: IndexError",
        "4.txt: not one printable line: 'one\\ntwo'",
        "5.txt: MemoryError",
    ]
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == ["1.txt", "3.txt", "4.txt", "5.txt"]
