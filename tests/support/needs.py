"""What tests need and a machine may lack. A test that lacks it skips, and the end of a run counts the reasons."""

import shutil
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

import pytest

from mplicits.model.errors import UserError
from mplicits.viewer.draw.context import Context, open_context
from support.paths import CASES

PROGRAMS = {
    "Chromium": ("chromium", "chromium-browser", "google-chrome"),
    "Firefox": ("firefox-esr", "firefox"),
    "Xvfb": ("Xvfb",),
    "xdotool": ("xdotool",),
    "glslang": ("glslangValidator",),
    "gcc": ("gcc",),
    "g++": ("g++",),
    "clang": ("clang",),
    "lld": ("wasm-ld",),
    "nvcc": ("nvcc",),
    "Godot": ("godot3",),
    "Blender": ("blender",),
}
"""A program -> the names that it may have."""


def lack(what: str) -> NoReturn:
    """Skip the test, which needs `what`."""
    pytest.skip(f"needs {what}")


def program(name: str) -> str:
    """Return the path of one of PROGRAMS. Skips the test where it is not installed."""
    return next(filter(None, map(shutil.which, PROGRAMS[name])), None) or lack(name)


def package(name: str) -> Any:
    """Return a module. Skips the test where its Python package is not installed."""
    return pytest.importorskip(name, reason=f"needs the Python package {name.partition('.')[0]}")


def context(kind: str) -> Context:
    """Open a context of `osmesa`, `egl` or `auto`. Skips the test where this machine has none of the kind."""
    try:
        return open_context(kind)
    except UserError:
        lack({"osmesa": "OSMesa", "egl": "EGL"}.get(kind, "OpenGL"))


def data(path: Path) -> pytest.MarkDecorator:
    """Mark tests that read a file or folder of `paths.DATA` or `paths.CASES`, which are not part of the project."""
    what = "cases beside MPLICITS_DATA" if path.is_relative_to(CASES) else "meshes of MPLICITS_DATA"
    return pytest.mark.skipif(not path.exists(), reason=f"needs the {what}")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Count the skipped tests by what they need, in one line."""
    reports = terminalreporter.stats.get("skipped", [])
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in reports)
    if reasons:
        counts = ", ".join(f"{reason}: {count}" for reason, count in reasons.most_common())
        terminalreporter.write_line(f"skipped: {counts}")
