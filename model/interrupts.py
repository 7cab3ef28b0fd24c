"""Ctrl-C and signals that end the process: work stops cleanly, also inside libraries that swallow exceptions."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C."""
HANGUP = getattr(signal, "SIGHUP", None)
"""The signal of a closed terminal; Windows has none."""
ENDINGS = {signal.SIGTERM: "terminated"} | ({HANGUP: "the terminal hung up"} if HANGUP else {})
"""Signals that end work as Ctrl-C does -> message. The exit code is 128 + the number of the signal."""
_received: list[signal.Signals] = []


def end_imports_at_once() -> None:
    """Let Ctrl-C end the process at once during an import; elsewhere Ctrl-C raises KeyboardInterrupt as usual.

    Changes nothing if the caller ignores Ctrl-C (nohup), or outside the main thread.
    """
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if usual and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _end_or_raise)


class SecondInterrupt(KeyboardInterrupt):
    """A second signal, while the first waits for the end of a step: work stops inside the step, and saves nothing."""


def begin_work(*, termination: bool = True) -> None:
    """Let Ctrl-C raise KeyboardInterrupt everywhere from now on, because there is work to save.

    termination: SIGTERM and SIGHUP raise it, too, unless the caller handles them (nohup); `ended_by` names the signal.
    """
    _received.clear()
    if signal.getsignal(signal.SIGINT) is _end_or_raise:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    main = threading.current_thread() is threading.main_thread()
    for number in ENDINGS if termination and main else ():
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _raise)


def let_children_hear_ctrl_c() -> None:
    """Where the caller ignores Ctrl-C (nohup), ignore it in a way that child processes do not inherit.

    So this process can interrupt them. Changes nothing outside the main thread.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)


def ended_by() -> signal.Signals | None:
    """Return the signal behind a KeyboardInterrupt since `begin_work`; None for Ctrl-C, or without an interrupt."""
    return _received[-1] if _received else None


@contextmanager
def held_back() -> Iterator[None]:
    """Delay Ctrl-C until the end of the block, for example because the block runs C code."""
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


@contextmanager
def between_steps() -> Iterator[Callable[[], None]]:
    """Let the signals that end work wait for the end of a step, so that no step is half done.

    Yields a function that the block calls between two steps: if a signal came, it acts on it, which usually raises
    KeyboardInterrupt. The end of the block does so, too. A second signal before that raises `SecondInterrupt` at once.
    Changes nothing for signals that the caller ignores or leaves to the system, or outside the main thread.
    """
    main = threading.current_thread() is threading.main_thread()
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, *ENDINGS)} if main else {}
    before = {number: handler for number, handler in found.items() if callable(handler)}
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)
        if len(came) > 1:
            try:
                before[signal.Signals(number)](number, frame)
            except KeyboardInterrupt:
                raise SecondInterrupt from None

    def act() -> None:
        if came:
            number = came.pop(0)
            before[signal.Signals(number)](number, None)

    for number in before:
        signal.signal(number, note)
    try:
        yield act
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    act()


def _raise(number: int, _: FrameType | None) -> None:
    _received.append(signal.Signals(number))
    if number == HANGUP:
        _leave_the_terminal()
    raise KeyboardInterrupt


def _leave_the_terminal() -> None:
    """Discard output if the terminal is gone, so that printing does not fail."""
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
