"""Signals as a shell in the foreground leaves them."""

import signal
from collections.abc import Iterator

import pytest

from mplicits.model.interrupts import ENDINGS, begin_work


@pytest.fixture
def usual_signals() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, and ENDINGS end the process: here, and in processes that the test starts.

    nohup and most runners ignore some of them, and child processes inherit that. Afterwards all is as it was.
    """
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *ENDINGS)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in ENDINGS:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
    begin_work(termination=False)  # forgets which signals came
