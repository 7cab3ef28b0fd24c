"""The rows of the paper's Table 2, and the models that they draw: for on_gpu.py and results_of_gpu.py."""

import subprocess
import sys
from pathlib import Path

MODELS_OF = {
    "siren": "256x4",
    "coarse": "64x2",
    "two-128": "64x2,128x2",
    "two-256": "64x2,256x2",
    "three": "64x2,128x2,256x2",
}
"""Name of a model -> its levels, as `mplicits train --levels` takes them."""
ROWS: tuple[tuple[str, str, tuple[int, int], int], ...] = (
    ("(256, 4), SIREN", "siren", (1, 1), 37),
    ("(64, 2)", "coarse", (1, 1), 315),
    ("(64, 2) > (128, 2), NM", "two-128", (1, 2), 177),
    ("(64, 2) > (128, 2)", "two-128", (2, 2), 150),
    ("(64, 2) > (256, 2), NM", "two-256", (1, 2), 94),
    ("(64, 2) > (256, 2)", "two-256", (2, 2), 75),
    ("(64, 2) > (128, 2) > (256, 2), NM", "three", (2, 3), 86),
    ("(64, 2) > (128, 2) > (256, 2)", "three", (3, 3), 70),
)
"""Title, model, (level, normal level), the paper's frames per second on an RTX 5090 at 512 x 512.

NM, normal mapping: the last level is not traced and only gives the normals.
"""


def train(path: Path, levels: str, *length: str) -> None:
    """Train a model of Armadillo with these levels and write it to `path`, unless it is there already.

    length: --seconds S or --steps N,.. of `mplicits train`.
    """
    if path.exists():
        return
    from protocol import DATA

    path.parent.mkdir(parents=True, exist_ok=True)
    shape = str(DATA / "meshes" / "armadillo.ply")
    command = [sys.executable, "-m", "mplicits", "train", shape, "--levels", levels, "--quiet", "-o", str(path)]
    subprocess.run([*command, *length], check=True)
