"""The wheel in an empty environment without torch: it lists, bakes and renders, and says which extra training needs."""

import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

from mplicits.model.model_file import save
from support import needs
from support.fitted_model import fitted_model
from support.paths import ROOT
from support.random_model import random_model

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["setuptools"]["packages"]
NOT_PACKED = {"tests", "benchmarks", "docs", "build", "dist", "out"}


def packed_folders() -> list[Path]:
    """Folders of the checkout that are packages, as paths below its root; the root itself comes first."""
    folders = (path.parent.relative_to(ROOT) for path in ROOT.rglob("__init__.py"))
    return sorted(path for path in folders if path.parts[:1] not in {(name,) for name in NOT_PACKED | {".venv"}})


def test_every_folder_with_code_is_packed() -> None:
    assert sorted(PACKAGES) == sorted(".".join(("mplicits", *path.parts)) for path in packed_folders())


def test_every_dependency_is_pinned() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {line.partition("==")[0].lower() for line in lines if "==" in line and not line.startswith("#")}
    extras = PROJECT["project"]["optional-dependencies"].values()
    required = {*PROJECT["project"]["dependencies"], *(name for extra in extras for name in extra)}
    names = {name.replace(">", "=").partition("=")[0] for name in required} | {"setuptools"}
    assert not names - pinned
    assert not [line for line in lines if line and not line.startswith("#") and line.count("==") != 1]


@dataclass(frozen=True)
class Installed:
    """An installed wheel."""

    wheel: Path
    """The wheel's file."""
    venv: Path
    """The virtual environment that it is installed in."""

    def add(self, extra: str) -> None:
        """Install an extra as well."""
        subprocess.run([*pip_into(self.venv), f"{self.wheel}[{extra}]"], check=True, capture_output=True)

    def run(self, *argv: str, cwd: Path) -> subprocess.CompletedProcess[str]:
        """Run `mplicits ARGV` as it is installed."""
        return subprocess.run(
            [self.venv / "bin" / "mplicits", *argv], capture_output=True, text=True, check=False, cwd=cwd, env=bare()
        )


def pip_into(venv: Path) -> list[str]:
    """The beginning of a command that installs packages into `venv` with our constraints."""
    return [str(venv / "bin" / "python"), "-m", "pip", "install", "-q", "-c", str(ROOT / "constraints.txt")]


def bare() -> dict[str, str]:
    """The environment variables of this process without those that lead to the source."""
    return {key: value for key, value in os.environ.items() if key not in {"PYTHONPATH", "VIRTUAL_ENV"}}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel, built from a copy of the source by way of the source archive, and installed."""
    needs.package("build")
    folder = tmp_path_factory.mktemp("packaging")
    source = folder / "source"
    skipped = shutil.ignore_patterns(".*", "out", "build", "dist", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, source, ignore=skipped)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder / "dist"), str(source)]
    subprocess.run(command, check=True, cwd=folder, env=bare(), capture_output=True)
    (wheel,) = (folder / "dist").glob("*.whl")
    venv = folder / "venv"
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    install = pip_into(venv)
    probe = subprocess.run([*install, "numpy"], capture_output=True, text=True, check=False)
    if probe.returncode:
        needs.lack("a package index")
    subprocess.run([*install, wheel], check=True, capture_output=True)
    return Installed(wheel, venv)


@pytest.mark.slow
def test_the_wheel_holds_the_rooms_and_nothing_else(installed: Installed) -> None:
    names = set(zipfile.ZipFile(installed.wheel).namelist())
    packed = {name for name in names if ".dist-info/" not in name}
    kinds = {".py", ".glsl", ".cuh", ".html", ".css", ".js", ".md", ".safetensors", ".wasm", ".wgsl", ".ts"}
    rooms = {path.parts[0] for path in packed_folders() if path.parts}
    sources = {path for room in rooms for path in (ROOT / room).rglob("*") if path.suffix in kinds}
    sources |= {*ROOT.glob("*.py"), ROOT / "py.typed"}
    assert packed == {f"mplicits/{path.relative_to(ROOT)}" for path in sources}
    assert any(name.endswith("/LICENSE") for name in names)


@pytest.mark.slow
def test_modules_of_the_user_s_own_are_not_taken_for_ours(installed: Installed, tmp_path: Path) -> None:
    for name in ("model", "trainer", "viewer", "codegen", "glsl", "mesher", "cli", "demo"):
        (tmp_path / f"{name}.py").write_text(f"raise SystemExit('{name}.py of the user was imported')\n")
    save(random_model((16, 1)), tmp_path / "m.safetensors")
    assert installed.run("info", "m.safetensors", cwd=tmp_path).returncode == 0
    assert installed.run("bake", "m.safetensors", "-o", "m.glsl", cwd=tmp_path).returncode == 0
    code = "import mplicits, mplicits.cli, mplicits.bake.registry; print(mplicits.__file__)"
    command = [str(installed.venv / "bin" / "python"), "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=bare())
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(done.stdout.strip()).is_relative_to(installed.venv)


@pytest.mark.slow
def test_without_torch_it_lists_bakes_and_says_what_training_needs(installed: Installed, tmp_path: Path) -> None:
    save(random_model((16, 1), (16, 2), texture=(8, 1)), tmp_path / "m.safetensors")
    shown = installed.run("--help", cwd=tmp_path)
    assert (shown.returncode, shown.stderr) == (0, "")
    assert all(f"    {verb} " in shown.stdout for verb in ("demo", "train", "info", "bake", "render", "view"))
    assert installed.run("--version", cwd=tmp_path).stdout == f"mplicits {PROJECT['project']['version']}\n"
    assert installed.run("info", "m.safetensors", cwd=tmp_path).returncode == 0
    assert installed.run("bake", "m.safetensors", "-o", "m.glsl", cwd=tmp_path).returncode == 0
    assert f'"mplicits": "{PROJECT["project"]["version"]}"' in (tmp_path / "m.glsl").read_text(encoding="utf-8")
    refused = installed.run("train", "demo", "-o", "d.safetensors", cwd=tmp_path)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr.startswith("mplicits: this needs the package ")
    assert "pip install 'mplicits[train]'" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.slow
def test_meshing_needs_its_extra_and_no_torch(installed: Installed, tmp_path: Path) -> None:
    save(fitted_model(), tmp_path / "m.safetensors")
    argv = ("mesh", "m.safetensors", "-o", "m.ply", "--resolution", "32", "--quiet")
    refused = installed.run(*argv, cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.endswith("run: pip install 'mplicits[mesh]' (220 MB)\n")
    installed.add("mesh")
    assert installed.run(*argv, cwd=tmp_path).returncode == 0
    compared = ("eval", "m.safetensors", "m.ply", "--resolution", "32", "--samples", "1000", "--quiet")
    done = installed.run(*compared, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert not list(installed.venv.glob("lib/*/site-packages/torch"))


@pytest.mark.slow
@pytest.mark.usefixtures("osmesa")
def test_without_torch_it_renders(installed: Installed, tmp_path: Path) -> None:
    save(random_model((16, 1)), tmp_path / "m.safetensors")
    argv = ("render", "m.safetensors", "-o", "m.png", "--size", "32x32", "--context", "osmesa")
    done = installed.run(*argv, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")
