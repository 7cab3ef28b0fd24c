"""What benchmarks of the page share: a page with lines changed, its frames, and the processor's time of a browser."""

import os
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from support.browser import Visit

TICK = os.sysconf("SC_CLK_TCK")
"""Ticks of the kernel's clock in a second."""


def descendants() -> list[int]:
    """Return the numbers of all processes that this one, or one of these, has started."""
    found = [os.getpid()]
    for process in found:  # It grows meanwhile.
        for children in Path(f"/proc/{process}/task").glob("*/children"):
            with suppress(OSError):  # of a thread that has ended
                found += [int(number) for number in children.read_text().split()]
    return found[1:]


def processor_seconds() -> float:
    """Return the seconds that the descendants that are alive have spent on a processor until now."""
    ticks = 0
    for process in descendants():
        with suppress(OSError):
            fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return ticks / TICK


def changed(text: str, changes: list[tuple[str, str]]) -> str:
    """Return a page's text with each of some places, which it has once, changed."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def turn(visited: "Visit", key: str) -> None:
    """Turn a page's view by a key, and wait until the picture is at rest."""
    visited.page.keyboard.press(key)
    visited.until("document.documentElement.dataset.state === 'drawing'")
    visited.still()


def shown_seconds(visited: "Visit") -> float:
    """Return the seconds that one sample of every pixel has taken, as the page says them of the picture at rest."""
    status = re.match(r"([\d.]+) (m?s) ·", visited.page.inner_text("#status"))
    assert status is not None
    return float(status[1]) / (1000 if status[2] == "ms" else 1)
