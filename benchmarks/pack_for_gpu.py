"""Gather what a run on a GPU needs and the machine with the GPU may lack, in the ignored folder out/gpu.

    nice python benchmarks/pack_for_gpu.py [--python 3.12] [--arch sm_90]

wheels/    packages that PyTorch does not bring, for that version of Python
lib/       the loaders of OpenGL and Vulkan; the driver is the machine's own
data/      the shapes of the data's folder that the stages of on_gpu.py read
models/    the models of Table 2, trained on Armadillo in few steps: speed depends on their widths, not on their quality
pictures/  reference pictures of the CUDA programs, drawn by the GLSL renderer on software OpenGL
programs/  the CUDA programs, compiled for --arch, each gzip-compressed; only where nvcc is installed
"""

import argparse
import gzip
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from gpu_commands import PACK, ROOT
from gpu_cuda import CAMERA
from gpu_programs import CHECKED, PROGRAMS, bake, compile_for, packed_of
from protocol import DATA
from table2 import MODELS_OF, train

WHEELS = (
    "moderngl",
    "glcontext",
    "glfw",
    "trimesh",
    "libigl",
    "safetensors",
    "tqdm",
    "wgpu",
    "cffi",
    "pycparser",
    "sniffio",
    "zopfli",
)
"""numpy, scipy, pillow and threadpoolctl are larger, and where PyTorch is installed they are as a rule, too."""
GLIBC = (28, 27, 17, 5)
"""Minor versions of glibc 2 whose wheels are taken."""
LIBRARIES = ("libEGL.so.1", "libGLdispatch.so.0", "libvulkan.so.1")
SHAPES = ("meshes/armadillo.ply", "meshes/lucy.ply")
STEPS = {"64x2": 800, "128x2": 600, "256x2": 400, "256x4": 400}
"""Optimizer steps of a level."""
SIDES = (256, 40)
"""Pixels a side of the reference pictures; the small ones are for the rehearsal without a GPU."""


def pin(name: str) -> str:
    """Return the package with the version of constraints.txt."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return next((line for line in lines if line.partition("==")[0] == name), name)


def fetch_wheels(python: str) -> None:
    """Download the wheels."""
    platforms = [f"--platform=manylinux_2_{minor}_x86_64" for minor in GLIBC]
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
    command += [f"--python-version={python}", *platforms, "-d", str(PACK / "wheels")]
    subprocess.run([*command, *map(pin, WHEELS)], check=True)


def copy_files() -> None:
    """Copy the loaders of this system, and the data."""
    (PACK / "lib").mkdir(parents=True, exist_ok=True)
    cache = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    found = {line.split()[0]: line.split()[-1] for line in cache.splitlines() if "x86-64" in line}
    for name in LIBRARIES:
        shutil.copyfile(found[name], PACK / "lib" / name)
    for shape in SHAPES:
        target = PACK / "data" / shape
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(DATA / shape, target)


def draw_references() -> None:
    """Draw every model of CHECKED at every size, one ray a pixel, as a PPM."""
    (PACK / "pictures").mkdir(exist_ok=True)
    for name in CHECKED:
        path = PACK / "models" / f"{name}.safetensors"
        for side in SIDES:
            png = PACK / "pictures" / f"{name}-{side}.png"
            command = [sys.executable, "-m", "mplicits", "render", str(path if path.exists() else name)]
            options = (f"--size={side}", f"--camera={CAMERA}", "--samples=1", "--force", "-o", str(png))
            subprocess.run([*command, *options], check=True)
            Image.open(png).convert("RGB").save(png.with_suffix(".ppm"))
            png.unlink()


def compile_programs(arch: str) -> None:
    """Compile the CUDA programs of the models for an architecture, as sm_90; those that are there stay."""
    if shutil.which("nvcc") is None:
        print("no CUDA programs: nvcc is not installed")
        return
    with tempfile.TemporaryDirectory() as scratch:
        source, program = Path(scratch, "model.cu"), Path(scratch, "model")
        for name in PROGRAMS:
            packed = packed_of(name, arch)
            if not packed.exists():
                bake(name, source)
                compile_for(arch, source, program)
                packed.parent.mkdir(parents=True, exist_ok=True)
                for older in packed.parent.glob(f"{arch}-*"):
                    older.unlink()
                packed.write_bytes(gzip.compress(program.read_bytes()))


def main() -> None:
    """Fill the folder; models that are there stay."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", default="3.12", help="version on the machine with the GPU (default 3.12)")
    parser.add_argument("--arch", default="sm_90", help="nvcc's architecture of its card (default sm_90: H100, H200)")
    options = parser.parse_args()
    copy_files()
    fetch_wheels(options.python)
    for name, levels in MODELS_OF.items():
        steps = ",".join(str(STEPS[level]) for level in levels.split(","))
        train(PACK / "models" / f"{name}.safetensors", levels, "--steps", steps)
    draw_references()
    compile_programs(options.arch)
    size = sum(path.stat().st_size for path in PACK.rglob("*") if path.is_file())
    print(json.dumps({"folder": str(PACK), "mebibytes": round(size / 2**20, 1)}))


if __name__ == "__main__":
    main()
