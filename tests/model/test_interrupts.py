"""Ctrl-C in the first seconds, in which mostly modules are loaded, ends the command with one line and no traceback.

A terminal that is closed ends a training as Ctrl-C does.
"""

import os
import pty
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest
import trimesh

from mplicits.model.interrupts import INTERRUPTED, begin_work, end_imports_at_once, held_back
from mplicits.model.model_file import load
from support.paths import ROOT

START = "import sys; from mplicits.__main__ import main; print(flush=True); sys.exit(main())"
TRAIN = ["train", "ball.ply", "-o", "ball.safetensors", "--levels", "8x1", "--steps", "1000000", "--quiet"]


@pytest.mark.usefixtures("usual_signals")
@pytest.mark.parametrize("seconds", [0.05, 0.4, 1.0])
def test_ctrl_c_while_modules_are_loaded(seconds: float, tmp_path: Path) -> None:
    trimesh.creation.icosphere(1).export(tmp_path / "ball.ply")
    command = [sys.executable, "-c", START, *TRAIN]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        process.stdout.readline()
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=300)
    assert (process.returncode, error) == (INTERRUPTED, "mplicits: interrupted\n")
    assert [path.name for path in tmp_path.iterdir()] == ["ball.ply"]


@pytest.mark.usefixtures("usual_signals")
def test_an_interrupted_import_ends_the_process_though_the_module_catches_everything(tmp_path: Path) -> None:
    (tmp_path / "stubborn.py").write_text(
        "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException:\n    pass\n"
    )
    code = "from mplicits.model.interrupts import *; end_imports_at_once(); import sys; sys.path.append(sys.argv[1])\n"
    command = [sys.executable, "-c", code + "import stubborn; print('swallowed')", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT.parent, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "", "mplicits: interrupted\n")


@pytest.mark.usefixtures("usual_signals")
def test_ctrl_c_is_an_exception_outside_imports_and_everywhere_at_work() -> None:
    end_imports_at_once()
    ours = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    begin_work()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler is not ours
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_imports_at_once()
    begin_work()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN, "the caller's handler stays"


@pytest.mark.usefixtures("usual_signals")
def test_ctrl_c_can_be_held_back() -> None:
    done = []

    def work() -> None:
        with held_back():
            signal.raise_signal(signal.SIGINT)
            done.append("all of the block")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with held_back():
        pass


@pytest.mark.slow
@pytest.mark.usefixtures("usual_signals")
def test_a_closed_terminal_ends_a_training_and_saves_the_model(tmp_path: Path) -> None:
    trimesh.creation.icosphere(1).export(tmp_path / "ball.ply")
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    # The terminal on stdin becomes the terminal of the process's session, as in a shell.
    start = f"import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n{START}"
    command = [sys.executable, "-c", start, *TRAIN[:-1]]
    with subprocess.Popen(
        command, cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True
    ) as process:
        os.close(theirs)
        seen = b""
        while b"mean |f|" not in seen:
            seen += os.read(ours, 1000)
        os.close(ours)
        assert process.wait(timeout=300) == 128 + signal.SIGHUP
    assert load(tmp_path / "ball.safetensors").provenance["interrupted"]
    assert (tmp_path / "ball.part.safetensors").exists()


def test_nohup_stays_in_force() -> None:
    code = "from mplicits.model.interrupts import *; signal.signal(signal.SIGHUP, signal.SIG_IGN); begin_work();"
    code += "signal.raise_signal(signal.SIGHUP); print('still there', ended_by())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT.parent, check=False)
    assert (done.stdout, done.stderr) == ("still there None\n", "")
