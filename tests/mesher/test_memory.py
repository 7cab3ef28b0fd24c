"""What does not fit the memory is refused in one line, by an estimate."""

import resource
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from mplicits import cli
from mplicits.mesher import cull
from mplicits.mesher.cull import BYTES_OF_BLOCK, culled
from mplicits.mesher.grid import Grid
from mplicits.mesher.parallel import Silent
from mplicits.mesher.surface import Array
from mplicits.model import memory
from mplicits.model.errors import UserError
from support.paths import DEMO


@pytest.mark.parametrize("more", [[], ["--no-cull"]], ids=["culled", "dense"])
def test_a_mesh_that_does_not_fit_is_refused(
    more: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["mesh", str(DEMO), "-o", str(tmp_path / "m.ply"), "--resolution", "40", "--quiet", *more]
    monkeypatch.setattr(memory, "free_memory", lambda: 2e5)
    assert cli.main(argv) == 2
    line = capsys.readouterr().err
    assert line.startswith("mplicits: --resolution 40: this surface needs some ")
    assert len(line.splitlines()) == 1
    assert not (tmp_path / "m.ply").exists()
    monkeypatch.setattr(memory, "free_memory", lambda: 1e8)
    assert cli.main(argv) == 0


def test_limits_of_machine_container_and_process_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "CGROUP", tmp_path)
    machine = memory.free_memory()
    assert 1e7 < machine < 1e14
    (tmp_path / "memory.max").write_text("max\n")
    (tmp_path / "memory.stat").write_text("anon 3000\nfile 900\n")
    assert memory.free_memory() > 1e7
    (tmp_path / "memory.max").write_text("5000\n")
    assert memory.free_memory() == 2000
    monkeypatch.setattr(resource, "getrlimit", lambda _: (4096, 4096))
    assert memory.free_memory() == 0


class Ball:
    """The distance to a sphere."""

    chunk = 4096

    def value(self, points: Array) -> Array:
        return np.asarray(np.linalg.norm(points, axis=1) - np.float32(0.7), np.float32)

    def clearance(self, points: Array) -> Array:
        return np.abs(self.value(points))


def test_what_is_needed_to_estimate_the_memory_is_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks are halved in parts: eight times as many of them at once would come before any estimate."""
    asked = []

    def refuse(needed: float, what: str, advice: str) -> None:
        asked.append(needed / BYTES_OF_BLOCK)
        raise UserError(f"{what}: {advice}")

    monkeypatch.setattr(cull, "check_memory", refuse)
    tracemalloc.start()
    try:
        with pytest.raises(UserError):
            culled(Ball(), Grid(512), Silent())
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    (blocks,) = asked
    assert blocks > 100_000
    assert most < 100 * blocks
