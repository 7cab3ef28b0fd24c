"""What the process of `child.py` does: it takes requests from its input until that ends, and decodes."""

import contextlib
import os
import signal
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from .frames import Arrays, receive, send

try:
    import resource
except ImportError:  # Windows: the clock of the other process is the only limit
    resource = None  # type: ignore[assignment]

LONGEST = 500  # characters of an error


def serve() -> None:
    """Answer requests: a frame of arrays each, or of an error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the other process's, which ends this one
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get between the answers
    while True:
        try:
            head, arrays = receive(sys.stdin.buffer, float("inf"))
        except EOFError:
            return
        answer, result = dict[str, str](), Arrays()
        try:
            result = _decoded(head, arrays)
        except BaseException as error:
            answer = {"error": type(error).__name__, "text": _text_of(error)}
        send(answers, answer, result)


def _decoded(head: dict[str, Any], arrays: Arrays) -> Arrays:
    module, name = head["function"]
    for package in (module, *head["packages"]):
        import_module(package)
    _limit(head["memory"], head["seconds"])
    decode = getattr(sys.modules[module], name)
    result: Arrays = decode(**head["arguments"], **arrays)
    return result


def _text_of(error: BaseException) -> str:
    if isinstance(error, ModuleNotFoundError):
        return str(error.name)
    return (str(error).splitlines() or [type(error).__name__])[0][:LONGEST]


def _limit(memory: int, seconds: float) -> None:
    """Limit the bytes that are allocated from now on, and the seconds of the processor."""
    if resource is None:
        return
    _set(resource.RLIMIT_CORE, 0)
    _set(resource.RLIMIT_CPU, max(int(time.process_time() + seconds), 0) + 1)
    with contextlib.suppress(OSError):  # other systems do not tell what is in use, and most do not keep the limit
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        _set(resource.RLIMIT_AS, used + memory)


@contextlib.contextmanager
def one_more_file() -> Iterator[None]:
    """Let one more file or connection be open at a time, in the whole process: the file that is decoded."""
    if resource is None:
        yield
        return
    before = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    free = os.open(os.devnull, os.O_RDONLY)
    os.close(free)
    _set(resource.RLIMIT_NOFILE, free + 1)
    try:
        yield
    finally:
        _set(resource.RLIMIT_NOFILE, before)


def _set(limit: int, value: int) -> None:
    """Set a soft limit, below the hard one."""
    hard = resource.getrlimit(limit)[1]
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(limit, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))
