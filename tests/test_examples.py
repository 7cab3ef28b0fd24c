"""The scripts in examples/ run, each in a folder of its own."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from support import needs
from support.paths import ROOT

SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
assert len(SCRIPTS) >= 5


def packages(script: Path) -> set[str]:
    """The names of the packages that a script imports."""
    nodes = list(ast.walk(ast.parse(script.read_text(encoding="utf-8"))))
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    return {name.partition(".")[0] for name in names}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_example_runs(script: Path, tmp_path: Path) -> None:
    for package in packages(script):
        needs.package(package)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}  # waiting threads take the time of other tests
    done = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() or list(tmp_path.iterdir()), "it prints something or writes a file"
