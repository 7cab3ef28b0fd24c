"""What Ctrl-C does where a library would swallow the exception, or die of it."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C."""
TERMINATED = 143
"""Exit code after SIGTERM."""
_received: list[int] = []


def end_imports_at_once() -> None:
    """Let Ctrl-C end the process at once where a module is being loaded; elsewhere it is KeyboardInterrupt as ever.

    Nothing changes where the caller has Ctrl-C ignored (nohup), or in a thread that is not the main one.
    """
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if usual and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _end_or_raise)


def begin_work(*, termination: bool = True) -> None:
    """Let Ctrl-C be KeyboardInterrupt everywhere from now on: there is something to lose, and somebody who saves it.

    termination: SIGTERM is, too, unless the caller has set what it does; `terminated` then tells which of them it was.
    """
    _received.clear()
    if signal.getsignal(signal.SIGINT) is _end_or_raise:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    main = threading.current_thread() is threading.main_thread()
    if termination and main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _raise)


def terminated() -> bool:
    """Whether a KeyboardInterrupt since `begin_work` came from SIGTERM."""
    return bool(_received)


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
    _received.append(number)
    raise KeyboardInterrupt


def _end_or_raise(_: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            os.write(2, b"mplicits: interrupted\n")
            os._exit(INTERRUPTED)
        frame = frame.f_back
    raise KeyboardInterrupt
