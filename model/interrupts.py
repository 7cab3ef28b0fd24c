"""What Ctrl-C does where a library would swallow the exception, or die of it."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C."""
ENDINGS = {signal.SIGTERM: "terminated", signal.SIGHUP: "the terminal hung up"}
"""Signals that end work as Ctrl-C does, and what is said then; the exit code is 128 + the signal's number."""
_received: list[signal.Signals] = []


def end_imports_at_once() -> None:
    """Let Ctrl-C end the process at once where a module is being loaded; elsewhere it is KeyboardInterrupt as ever.

    Nothing changes where the caller has Ctrl-C ignored (nohup), or in a thread that is not the main one.
    """
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if usual and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _end_or_raise)


def begin_work(*, termination: bool = True) -> None:
    """Let Ctrl-C be KeyboardInterrupt everywhere from now on: there is something to lose, and somebody who saves it.

    termination: so are SIGTERM and SIGHUP, unless the caller has set what they do (nohup); `ended_by` then tells which
    of them it was.
    """
    _received.clear()
    if signal.getsignal(signal.SIGINT) is _end_or_raise:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    main = threading.current_thread() is threading.main_thread()
    for number in ENDINGS if termination and main else ():
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _raise)


def ended_by() -> signal.Signals | None:
    """Return the signal that a KeyboardInterrupt since `begin_work` came from; None: from Ctrl-C, or there was none."""
    return _received[-1] if _received else None


@contextmanager
def held_back() -> Iterator[None]:
    """Hold back Ctrl-C until the end of the block, which may be of C code that cannot take an exception."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    pressed = []
    signal.signal(signal.SIGINT, lambda *_: pressed.append(True))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


def _raise(number: int, _: FrameType | None) -> None:
    _received.append(signal.Signals(number))
    if number == signal.SIGHUP:
        _leave_the_terminal()
    raise KeyboardInterrupt


def _leave_the_terminal() -> None:
    """Let what is printed go nowhere where the terminal is gone, so that printing fails nothing that is yet to do."""
    for stream in (1, 2):
        try:
            os.write(stream, b"")
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream)
            os.close(nowhere)


def _end_or_raise(_: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            os.write(2, b"mplicits: interrupted\n")
            os._exit(INTERRUPTED)
        frame = frame.f_back
    raise KeyboardInterrupt
