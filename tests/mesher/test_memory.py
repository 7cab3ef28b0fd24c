"""What does not fit the memory is refused in one line, by an estimate."""

import resource
from pathlib import Path

import pytest

from mplicits import cli
from mplicits.mesher import memory
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
