"""The evaluation of a contender, the machine's description, and the page that results are written to."""

import os
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import torch

from contenders import Trained
from mplicits.mesher.extract import extract
from mplicits.mesher.grid import Grid
from mplicits.mesher.metrics import SampledSurface, chamfer
from mplicits.mesher.read_meshes import in_model_space, read_mesh
from mplicits.model.version import installed_version
from mplicits.trainer.shapes.shape import Shape

DATA = Path(os.environ.get("MPLICITS_DATA", Path(__file__).parents[2] / "shared" / "data"))
"""The folder of meshes that are not part of the repository."""


class Truth:
    """A mesh that reconstructions are compared with, as samples of its surface in model space."""

    floor: float
    """Chamfer distance of two samplings of the mesh, which no reconstruction can get far below."""

    def __init__(self, path: Path, shape: Shape, samples: int, seed: int) -> None:
        """path: the mesh. shape: gives its normalization. samples: of each surface that is compared."""
        self._rng, self._samples = np.random.default_rng(seed), samples
        surface = SampledSurface(in_model_space(read_mesh(path), shape.center, shape.scale))
        self.points, again = (surface.sample(samples, self._rng)[0] for _ in range(2))
        self.floor = chamfer(self.points, again)

    def evaluate(self, trained: Trained, resolution: int) -> tuple[float, float]:
        """Extract the contender's mesh. Returns its squared-L2 Chamfer distance, and the seconds to extract it.

        The distance is infinite where there is no mesh.
        """
        began = time.perf_counter()
        mesh = extract(trained.field(Grid(resolution).diagonal), resolution)
        seconds = time.perf_counter() - began
        if not len(mesh.faces):
            return float("inf"), seconds
        return chamfer(SampledSurface(mesh).sample(self._samples, self._rng)[0], self.points), seconds


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
