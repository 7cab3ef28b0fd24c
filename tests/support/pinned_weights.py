"""Print a hash of the weights of four short trainings, to show that a change leaves training alone.

Run it before and after the change, on one machine:
`OMP_NUM_THREADS=1 .venv/bin/python tests/support/pinned_weights.py`.
Hashes differ between machines and versions of PyTorch, so no test compares them with stored ones.
"""

import subprocess
import sys
import tempfile
from hashlib import sha256
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

SHORT = ["--steps", "50", "--seed", "0", "--levels", "16x1,16x2", "--quiet"]


def main() -> None:
    """Train a mesh, a cloud, a textured mesh and a morph for 50 steps a level, and print a hash of each model."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_shapes(folder)
        trainings = {
            "mesh": ["train", "ball.obj"],
            "cloud": ["train", "cloud.xyz", "--noise", "0.01"],
            "texture": ["train", "demo"],
            "morph": ["morph", "ball.obj", "box.obj"],
        }
        for kind, command in trainings.items():
            output = folder / f"{kind}.safetensors"
            line = [sys.executable, "-P", "-m", "mplicits", *command, "-o", str(output), *SHORT]
            subprocess.run(line, cwd=folder, check=True, capture_output=True)
            tensors = load_file(output)
            digest = sha256(b"".join(name.encode() + tensors[name].tobytes() for name in sorted(tensors)))
            print(f"{kind:8} {digest.hexdigest()[:16]}", flush=True)


def write_shapes(folder: Path) -> None:
    """Write an ellipsoid and a box as OBJ, and noisy points of a sphere with their normals as XYZ."""
    import trimesh

    trimesh.creation.icosphere(subdivisions=3).apply_scale([1.0, 0.8, 0.6]).export(folder / "ball.obj")
    trimesh.creation.box([1.0, 1.2, 0.8]).export(folder / "box.obj")
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = normals + rng.normal(scale=0.01, size=normals.shape)
    np.savetxt(folder / "cloud.xyz", np.hstack((points, normals)), fmt="%.6f")


if __name__ == "__main__":
    main()
