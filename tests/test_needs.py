"""The end of a run counts what skipped tests lacked."""

from types import SimpleNamespace
from typing import Any

import pytest

from support import needs


def test_the_end_of_a_run_counts_what_was_missing() -> None:
    lines: list[str] = []
    reports = []
    for name in ("Xvfb", "Godot", "Xvfb"):
        with pytest.raises(pytest.skip.Exception) as skipped:
            needs.lack(name)
        reports.append(SimpleNamespace(longrepr=("a.py", 1, f"Skipped: {skipped.value}")))
    reporter: Any = SimpleNamespace(stats={"skipped": reports}, write_line=lines.append)
    needs.pytest_terminal_summary(reporter)
    assert lines == ["skipped: needs Xvfb: 2, needs Godot: 1"]
    reporter.stats = {}
    needs.pytest_terminal_summary(reporter)
    assert len(lines) == 1
