"""Runs a decoder in a process of its own, within limits of memory and time: what brings it down is one line here."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.memory import allowed
from .frames import Arrays, receive, send

Decoder = Callable[..., Arrays]
"""A function of a module: takes numbers, texts and arrays of numbers by name, and returns arrays."""
SECONDS = 15.0
"""Seconds of the processor, and of the clock, that a small file may take in all, starts of the process included."""
SECONDS_A_BYTE = 4e-6
"""More seconds for each byte: the slowest decoder, of 3MF, takes a fourth of it on one core."""
START = (
    "import json, sys; from importlib import import_module; "
    "sys.path[:] = json.loads(sys.argv[1]); import_module(sys.argv[2]).serve()"
)
FEW_THREADS = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Threads reserve address space, which counts as memory: 64 cores would use up the limit before the first point."""
ENVIRONMENT = {**FEW_THREADS, "RAYON_NUM_THREADS": "4", "MALLOC_ARENA_MAX": "2"}


class Child:
    """A process that decodes one thing after another, and is started by the first. Not for several threads at once."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._late = False
        self._size = 0
        self._taken = 0
        self._spent = 0.0

    def call(self, decode: Decoder, packages: Sequence[str], size: int, **arguments: Any) -> Arrays:
        """Return decode(**arguments), made in the process.

        packages: what is imported there before the limits hold. size: bytes of the file. Memory and time of all calls
        are limited in proportion to it, and what they return to half of that memory. Raises ModuleNotFoundError
        for a missing package, ValueError for what the decoder raises, and UserError for its UserError, for a crash, and
        beyond the limits.
        """
        for name in packages:
            if find_spec(name) is None:
                raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        self._size = max(self._size, size)
        memory, seconds = allowed(self._size), SECONDS + SECONDS_A_BYTE * self._size
        arrays = {name: value for name, value in arguments.items() if isinstance(value, np.ndarray)}
        head = {
            "function": [decode.__module__, decode.__qualname__],
            "packages": list(packages),
            "memory": memory,
            "seconds": seconds - self._spent,
            "arguments": {name: value for name, value in arguments.items() if name not in arrays},
        }
        process = self._process = self._process or _started()
        timer, started = threading.Timer(seconds - self._spent, self._stop), time.monotonic()
        timer.start()
        try:
            answer, result = self._exchange(process, head, arrays, memory // 2 - self._taken)
        except BaseException as error:  # also Ctrl-C: the process must not outlive the call
            self.close()
            if isinstance(error, MemoryError):
                raise _too_much_memory(memory) from None
            if isinstance(error, EOFError | OSError | ValueError):
                raise _ended(process.returncode, self._late, seconds) from None
            raise
        finally:
            timer.cancel()
            self._spent += time.monotonic() - started
        if answer:
            raise _error_of(answer["error"], answer["text"], memory)
        self._taken += sum(array.nbytes for array in result.values())
        return result

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with contextlib.suppress(OSError):  # what is left in its buffer has no reader
                        stream.close()

    def _stop(self) -> None:
        process = self._process
        if process is not None:
            self._late = True
            process.kill()

    @staticmethod
    def _exchange(
        process: subprocess.Popen[bytes], head: dict[str, Any], arrays: Arrays, most: int
    ) -> tuple[dict[str, Any], Arrays]:
        assert process.stdin is not None
        assert process.stdout is not None
        send(process.stdin, head, arrays)
        return receive(process.stdout, most)


def in_child(decode: Decoder, packages: Sequence[str], size: int, **arguments: Any) -> Arrays:
    """Return decode(**arguments), made in a process of its own; see `Child.call`."""
    child = Child()
    try:
        return child.call(decode, packages, size, **arguments)
    finally:
        child.close()


_children: weakref.WeakKeyDictionary[object, Child] = weakref.WeakKeyDictionary()


def child_of(owner: object) -> Child:
    """Return the process of an object with many things to decode; it ends with the object."""
    child = _children.get(owner)
    if child is None:
        child = _children[owner] = Child()
        weakref.finalize(owner, child.close)
    return child


def _started() -> subprocess.Popen[bytes]:
    """Start the process. It finds modules where this one does; -P keeps the current folder out."""
    places = [place or os.getcwd() for place in sys.path]
    return subprocess.Popen(
        [sys.executable, "-P", "-c", START, json.dumps(places), f"{__package__}.child_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | ENVIRONMENT,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # Windows
    )


def _error_of(kind: str, text: str, memory: float) -> Exception:
    """Return the error that a decoder raised."""
    if kind == "ModuleNotFoundError":
        return ModuleNotFoundError(f"No module named {text!r}", name=text)
    if kind == "MemoryError":
        return _too_much_memory(memory)
    return UserError(text) if kind == "UserError" else ValueError(text)


def _too_much_memory(memory: float) -> UserError:
    return UserError(
        f"decoding it takes more than {memory / 1e9:.2g} GB of memory, which is too much for a file of its size; "
        "write it anew, or in parts"
    )


def _ended(code: int | None, late: bool, seconds: float) -> UserError:
    """Say why the process ended. code: its exit code, minus the number of the signal that ended it."""
    if late or code == -getattr(signal, "SIGXCPU", 0):
        return UserError(
            f"decoding it takes longer than {seconds:.0f} s, which is too long for a file of its size; "
            "write it anew, or in parts"
        )
    try:
        name = signal.Signals(-(code or 0)).name
    except ValueError:
        name = f"exit code {code}"
    return UserError(f"its decoder crashed ({name}): the file is damaged; write it anew with the program it comes from")
