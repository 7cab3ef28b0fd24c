"""Windows has no fcntl, no resource and no SIGHUP: every room but the trainer's must import and work without them."""

import subprocess
import sys
from pathlib import Path

from support.paths import ROOT

HIDDEN = """
import signal, sys
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
del signal.SIGHUP
"""
NOT_IMPORTED = {"trainer", "capture", "tests", "benchmarks", "examples", "docs", "build", "out", ".venv"}
"""Folders whose modules need torch, or are no part of the package."""


def run_hidden(code: str, *argv: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """Run Python code in a process that lacks the modules that Windows lacks."""
    command = [sys.executable, "-P", "-c", HIDDEN + code, *argv]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def test_every_module_imports_without_the_modules_that_windows_lacks(tmp_path: Path) -> None:
    paths = (path.relative_to(ROOT) for path in sorted(ROOT.rglob("*.py")))
    ours = [path for path in paths if path.parts[0] not in NOT_IMPORTED and path.name != "__main__.py"]
    names = [".".join(("mplicits", *path.with_suffix("").parts)).removesuffix(".__init__") for path in ours]
    assert len(names) > 100
    code = "import importlib\nfor name in sys.argv[1:]:\n    importlib.import_module(name)\n"
    done = run_hidden(code, *names, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_shader_is_baked_and_leftovers_are_swept_without_locks(tmp_path: Path) -> None:
    code = "from mplicits.cli import main\nsys.exit(main(['bake', 'spot-small', '-o', 'spot.glsl']))"
    done = run_hidden(code, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["spot.glsl"]
