"""Compiles the kernel, with Debian's packages clang and lld.

    python web/compile_kernel.py [-o FILE]

kernel/siren.wasm is part of the repository, so that only a change of kernel/siren.c needs a compiler.
"""

import argparse
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_name("kernel") / "siren.c"
FLAGS = (
    *(
        "--target=wasm32",
        "-O2",
        "-fno-inline-functions",
        "-msimd128",
        "-std=c11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-fvisibility=hidden",
    ),
    *("-nostdlib", "-Wl,--no-entry", "-Wl,--export-dynamic", "-Wl,--strip-all"),
)


def compile_kernel(output: Path) -> None:
    """Compile the kernel to a file. Raises CalledProcessError, or FileNotFoundError without clang."""
    subprocess.run(["clang", *FLAGS, "-o", output, SOURCE], check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="compile the kernel of the studio")
    parser.add_argument("-o", "--output", type=Path, default=SOURCE.with_suffix(".wasm"))
    compile_kernel(parser.parse_args().output)
