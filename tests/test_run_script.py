"""The script `run`: its first call sets everything up, and later calls do not do it again.

Python, dpkg and apt are replaced by stand-ins that keep a log of how they are called.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from support.paths import ROOT

PYTHON = """#!/bin/sh
here=$(dirname "$0")
case "$*" in
    -V) echo "Python $(cat "$FAKE/version")"; exit ;;
    *version_info*) exec test "$(cat "$FAKE/version")" != 3.9.2 ;;
    *ensurepip*) exec test ! -e "$FAKE/no-ensurepip" ;;
esac
echo "$*" >>"$FAKE/log"
case "$*" in
    '-m venv '*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
    *"$(cat "$FAKE/failing")"*) exit 3 ;;
esac
"""
STAND_INS = {
    "python3": PYTHON,
    "dpkg-query": '#!/bin/sh\nfor name; do :; done\ngrep -q "$name" "$FAKE/lacking" || echo \'ii \'\n',
    "apt-get": '#!/bin/sh\necho "apt-get $*" >>"$FAKE/log"\nfor name; do :; done\n'
    'test -e "$FAKE/broken" || sed -i "/$name/d" "$FAKE/lacking"\n',
    "id": '#!/bin/sh\ncat "$FAKE/user"\n',
    "sudo": "#!/bin/sh\nexit 1\n",
    "c++": "#!/bin/sh\n",
}
VENV, PROJECT = "-m venv", "--no-build-isolation -e ."
SETUPTOOLS = "-m pip install -q -c constraints.txt setuptools numpy"
ALL = "train,mesh,capture,view,formats,dev"
CHECKS = ["-m ruff check", "-m ruff format --check", "-m mypy -p mplicits", "-m mypy tests benchmarks"]


class Checkout:
    """A folder with the script `run`, and stand-ins for the programs that it calls."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "a $check 'out"
        self.fake = folder / "fake"
        self.folder.mkdir()
        self.fake.mkdir()
        shutil.copy(ROOT / "run", self.folder)
        for name in ("constraints.txt", "pyproject.toml"):
            (self.folder / name).write_text("")
        for name, text in STAND_INS.items():
            (self.fake / name).write_text(text)
            (self.fake / name).chmod(0o755)
        for name, text in (("version", "3.11.2"), ("failing", "nothing fails"), ("lacking", ""), ("user", "0")):
            self.set(name, text)

    def set(self, name: str, text: str) -> None:
        """Decide how the stand-ins behave.

        name: `version`, of Python; `failing`, a part of the arguments with which Python fails; `lacking`, the packages
        that are not installed; `user`, the id of the user.
        """
        (self.fake / name).write_text(text + "\n")

    def run(self, *argv: str) -> tuple[int, list[str], str]:
        """Run `./run ARGV`. Returns its exit code, the calls in the log, and what it printed."""
        (self.fake / "log").write_text("")
        environment = {**os.environ, "PATH": f"{self.fake}:{os.environ['PATH']}", "FAKE": str(self.fake), "PYTHON": ""}
        done = subprocess.run(
            [self.folder / "run", *argv],
            capture_output=True,
            text=True,
            check=False,
            cwd="/",
            env=environment,
            stdin=subprocess.DEVNULL,
        )
        assert not done.stdout or not argv
        return done.returncode, (self.fake / "log").read_text().splitlines(), done.stdout + done.stderr


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Checkout:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return Checkout(tmp_path)


def test_without_arguments_it_prints_its_usage(checkout: Checkout) -> None:
    code, called, said = checkout.run()
    assert (code, called) == (0, [])
    assert "./run demo" in said
    assert "./run test" in said


def test_the_second_call_does_no_set_up(checkout: Checkout) -> None:
    code, called, _ = checkout.run("render", "a b", "*")
    verb = "-P -m mplicits render a b *"
    assert code == 0
    assert called[0] == f"{VENV} {checkout.folder}/.venv"
    assert called[1] == SETUPTOOLS
    assert called[2].endswith(PROJECT)
    assert called[3:] == [verb]
    assert checkout.run("render", "a b", "*") == (0, [verb], "")


def installs(called: list[str]) -> list[str]:
    """What pip installed, of the calls in the log: the project with its extras."""
    return [line.rpartition(" ")[2] for line in called if "--no-build-isolation" in line]


def test_a_verb_installs_no_extra_and_the_tests_install_all(checkout: Checkout) -> None:
    assert installs(checkout.run("info")[1]) == ["."]
    assert installs(checkout.run("test")[1]) == [f".[{ALL}]", f".[{ALL},meshopt]"]
    assert installs(checkout.run("test")[1]) == []


def test_a_missing_extra_is_added_to_the_installed_ones_before_the_verb_runs(checkout: Checkout) -> None:
    checkout.run("info")
    called = checkout.run("--install", "mesh", "mesh", "spot")[1]
    assert (installs(called), called[-1]) == ([".[mesh]"], "-P -m mplicits mesh spot")
    assert installs(checkout.run("--install", "train", "train", "demo")[1]) == [".[mesh,train]"]
    (checkout.folder / "pyproject.toml").write_text("changed")
    assert installs(checkout.run("info")[1]) == [".[mesh,train]"]


def test_with_a_display_the_window_gets_its_panel(checkout: Checkout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":7")
    assert installs(checkout.run("demo")[1]) == [".[view]"]


def test_a_changed_project_is_installed_again_and_a_changed_python_needs_a_new_venv(checkout: Checkout) -> None:
    checkout.run("info")
    (checkout.folder / "pyproject.toml").write_text("changed")
    called = checkout.run("info")[1]
    assert called[0] == SETUPTOOLS
    assert len(called) == 3
    checkout.set("version", "3.12.1")
    assert checkout.run("info")[1][0].startswith(VENV)
    checkout.folder = checkout.folder.rename(checkout.folder.with_name("moved"))
    assert checkout.run("info")[1][0] == f"{VENV} {checkout.folder}/.venv"
    assert len(checkout.run("info")[1]) == 1


@pytest.mark.parametrize("failing", ["setuptools", "-e ."])
def test_a_set_up_cut_short_begins_anew(failing: str, checkout: Checkout) -> None:
    checkout.set("failing", failing)
    code, called, said = checkout.run("info")
    assert code == 1
    assert failing in called[-1]
    assert said.splitlines()[-1].startswith("run: pip could not install")
    checkout.set("failing", "nothing fails")
    code, called, _ = checkout.run("info")
    assert code == 0
    assert called[0].startswith(VENV)


def test_the_tests_stop_at_the_first_failure(checkout: Checkout) -> None:
    checkout.run("test")
    assert checkout.run("test", "-k", "a b")[:2] == (0, [*CHECKS, "-m pytest -k a b"])
    checkout.set("failing", "mypy -p")
    assert checkout.run("test")[:2] == (3, CHECKS[:3])
    checkout.set("failing", "pytest")
    assert checkout.run("test")[0] == 3


def test_javascript_is_checked_where_deno_is_installed(checkout: Checkout) -> None:
    checkout.run("test")
    assert "run: no deno; JavaScript is not checked" in checkout.run("test")[2]
    deno = checkout.folder / ".venv" / "bin" / "deno"
    shutil.copy(checkout.folder / ".venv" / "bin" / "python", deno)
    of_deno = ["fmt --check", "lint", "check -q --no-remote web"]
    assert checkout.run("test")[:2] == (0, [*CHECKS, *of_deno, "-m pytest"])
    checkout.set("failing", "lint")
    assert checkout.run("test")[:2] == (3, [*CHECKS, *of_deno[:2]])


def test_an_old_python_is_one_line(checkout: Checkout) -> None:
    checkout.set("version", "3.9.2")
    code, called, said = checkout.run("demo")
    assert (code, called) == (1, [])
    assert said.splitlines()[-1] == "run: Python 3.9.2 is too old; install Python 3.11 or newer, or name one in PYTHON"


def test_root_installs_what_is_missing(checkout: Checkout) -> None:
    checkout.set("lacking", "libosmesa6\nlibegl1")
    code, called, _ = checkout.run("info")
    apt = [line.split()[-1] for line in called if line.startswith("apt-get install")]
    assert (code, apt) == (0, ["libosmesa6", "libegl1"])


@pytest.mark.parametrize("user", ["0", "1000"])
def test_where_apt_cannot_one_line_names_the_packages(user: str, checkout: Checkout) -> None:
    checkout.set("user", user)
    checkout.set("broken", "")
    checkout.set("lacking", "libosmesa6\nlibegl1")
    code, called, said = checkout.run("info")
    assert code == 0
    assert "run: not installed; as root: apt-get install libosmesa6 libegl1" in said.splitlines()
    assert any(line.startswith("apt-get") for line in called) == (user == "0")


def test_without_ensurepip_it_says_what_to_install(checkout: Checkout) -> None:
    checkout.set("no-ensurepip", "")
    checkout.set("user", "1000")
    checkout.set("lacking", "python3-venv")
    code, called, said = checkout.run("info")
    assert (code, called) == (1, [])
    assert said.splitlines()[-1] == "run: python3 cannot make a venv; as root: apt-get install python3-venv"
