"""Decoders in a process of their own: what they return, and the line that each way to fail becomes."""

import gc
import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from mplicits.model.errors import UserError
from mplicits.readers import child
from mplicits.readers.child import Child, Decoder, child_of, in_child
from support import decoders


def is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


class Owner:
    """Something with many things to decode."""


def test_arrays_come_back_from_one_process_that_ends_with_its_owner() -> None:
    owner = Owner()
    values = np.arange(6.0).reshape(2, 3)
    answers = [child_of(owner).call(decoders.twice, (), 48, values=values, text="é\n") for _ in range(2)]
    np.testing.assert_array_equal(answers[1]["é\n"], 2 * values)
    process = int(answers[0]["process"])
    assert process == int(answers[1]["process"]) != os.getpid()
    del owner
    gc.collect()
    assert not is_running(process)


def test_threads_have_processes_of_their_own() -> None:
    def ask(number: int) -> float:
        return float(in_child(decoders.twice, (), 1, values=np.array(float(number)), text="x")["x"])

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(ask, range(3))) == [0.0, 2.0, 4.0]


def test_errors_come_back_and_the_process_goes_on(tmp_path: Path) -> None:
    one = Child()
    with pytest.raises(UserError, match=r"^it is empty$"):
        one.call(decoders.refuse, (), 1)
    with pytest.raises(ValueError, match=r"^code -2$"):
        one.call(decoders.fail, (), 1)
    with pytest.raises(ModuleNotFoundError) as missing:
        one.call(decoders.lack, (), 1)
    assert missing.value.name == "no_such_package"
    assert one.call(decoders.printing, (), 1)["ones"].tolist() == [1, 1, 1]
    (tmp_path / "a").touch()
    with pytest.raises(ValueError, match="Too many open files"):
        one.call(decoders.open_two, (), 1, path=str(tmp_path / "a"))
    one.close()


def test_a_missing_package_is_said_before_a_process_starts() -> None:
    one = Child()
    with pytest.raises(ModuleNotFoundError) as missing:
        one.call(decoders.crash, ("numpy", "no_such_package"), 1)
    assert missing.value.name == "no_such_package"


@pytest.mark.parametrize(
    ("decode", "says"),
    [
        (decoders.crash, r"its decoder crashed \(SIGABRT\)"),
        (decoders.sleep, "decoding it takes longer than 1 s"),
        (decoders.hog, "decoding it takes more than 0.1 GB of memory"),
        (decoders.much, "decoding it takes more than 0.1 GB of memory"),
        (decoders.objects, "its decoder crashed"),
    ],
)
def test_what_brings_a_process_down_is_one_line(decode: Decoder, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "SECONDS", 1.0 if decode is decoders.sleep else 15.0)
    monkeypatch.setattr(child, "allowed", lambda size: 100_000_000)
    started = time.monotonic()
    with pytest.raises(UserError, match=says) as refused:
        in_child(decode, (), 1)
    assert str(refused.value).isprintable()
    assert time.monotonic() - started < 10


@pytest.mark.usefixtures("usual_signals")
def test_ctrl_c_ends_the_wait_and_the_process() -> None:
    one = Child()
    one.call(decoders.printing, (), 1)
    assert one._process is not None
    process = one._process.pid
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        one.call(decoders.sleep, (), 1)
    assert not is_running(process)
