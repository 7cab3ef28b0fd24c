"""The folder of meshes, the machine's description, and the page that results are written to."""

import os
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import torch

from mplicits.model.version import installed_version

DATA = Path(os.environ.get("MPLICITS_DATA", Path(__file__).parents[2] / "shared" / "data"))
"""The folder of meshes that are not part of the repository."""


def machine() -> str:
    """Describe what printed a page: version of mplicits, processor, cores, versions of libraries, date."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    name = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown processor")
    versions = f"torch {torch.__version__}, NumPy {np.__version__}"
    return f"mplicits {installed_version()}, {name}, {os.cpu_count()} cores, {versions}, {datetime.now(UTC):%Y-%m-%d}"


class Page:
    """A markdown file that grows by lines, so that a run cut short keeps its rows."""

    def __init__(self, path: Path, *lines: str) -> None:
        """lines: the page's head."""
        self._path, self._lines = path, list(lines)
        self._write()

    def add(self, *lines: str) -> None:
        """Append lines to the file, and print them."""
        print(*lines, sep="\n", flush=True)
        self._lines += lines
        self._write()

    def _write(self) -> None:
        self._path.write_text("\n".join(self._lines) + "\n", encoding="utf-8")
