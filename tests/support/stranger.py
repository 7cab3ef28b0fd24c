"""A stranger's machine: a clean copy of the checkout, nothing beside it, a plain user, no variables of ours."""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from support import needs
from support.paths import ROOT

MODULE = "spot"
"""The model in the shipped module."""
PATH = "/usr/local/bin:/usr/bin:/bin"
PLAIN_USER, GROUP = "nobody", "nogroup"
"""The user of the stranger's commands, and its group, where the tests run as root."""


@dataclass(frozen=True)
class Stranger:
    """A stranger's folder, and the commands that run in it."""

    folder: Path
    """It holds `mplicits`, the copy of the checkout, and `venv`, in which the wheel is installed."""
    user: str | None
    """Who runs the commands; None: the user of the tests."""

    @property
    def source(self) -> Path:
        """The copy of the checkout."""
        return self.folder / "mplicits"

    def options(self, **variables: str) -> dict[str, Any]:
        """Return the options of `subprocess` that make a command the stranger's. variables: further ones."""
        pip = {key: value for key, value in os.environ.items() if key.startswith("PIP_")}  # where packages come from
        environment = {"PATH": f"{self.folder}/venv/bin:{PATH}", "HOME": str(self.folder / "home"), "LANG": "C.UTF-8"}
        environment |= pip | {"PIP_CONSTRAINT": str(self.source / "constraints.txt")} | variables
        mine: dict[str, Any] = {"user": self.user, "group": GROUP, "extra_groups": []} if self.user else {}
        return {"env": environment, "stdin": subprocess.DEVNULL, **mine}

    def start(self, command: str, cwd: Path | None = None, **variables: str) -> "subprocess.Popen[str]":
        """Start a line of shell; what it prints goes to one pipe."""
        options = self.options(**variables) | {"cwd": cwd or self.folder}
        return subprocess.Popen(
            command, shell=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options
        )

    def run(self, command: str, cwd: Path | None = None, **variables: str) -> str:
        """Run a line of shell, and return what it prints. Raises AssertionError with that if it fails."""
        return ended(self.start(command, cwd, **variables))


def plain_user() -> str | None:
    """Return who runs the stranger's commands; None: the user of the tests."""
    return PLAIN_USER if os.getuid() == 0 else None


def ended(process: "subprocess.Popen[str]") -> str:
    """Wait for a command, and return what it prints. Raises AssertionError with that if it fails."""
    printed = process.communicate()[0]
    assert process.returncode == 0, f"{process.args!r} ended with {process.returncode}:\n{printed}"
    return printed


def stranger() -> Stranger:
    """Make a stranger's folder, with the copy and an empty virtual environment. Skips the test without git."""
    if not (ROOT / ".git").exists():
        needs.lack("a git checkout")
    listing = ["git", "ls-files", "-zco", "--exclude-standard"]
    files = subprocess.run(listing, cwd=ROOT, capture_output=True, check=True).stdout
    made = Stranger(Path(tempfile.mkdtemp(prefix="stranger-")), plain_user())
    made.folder.chmod(0o755)
    for name in filter(None, files.decode().split("\0")):
        if (ROOT / name).exists():  # not removed since the last commit
            (made.source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, made.source / name)
    (made.folder / "home").mkdir()
    if made.user:
        for path in (made.folder, *made.folder.rglob("*")):
            shutil.chown(path, made.user, GROUP)
    made.run(f"{_python(made)} -m venv venv")
    return made


def _python(made: Stranger) -> str:
    """Return a Python that the stranger may run. Skips the test where there is none of our version with venv."""
    check = "import ensurepip, sys; sys.exit(sys.version_info < (3, 11))"
    for candidate in filter(None, (shutil.which("python3", path=PATH), sys.executable)):
        try:
            subprocess.run([candidate, "-c", check], cwd="/", check=True, capture_output=True, **made.options())
        except (PermissionError, subprocess.CalledProcessError):
            continue
        return candidate
    return needs.lack("a Python with venv for a plain user")
