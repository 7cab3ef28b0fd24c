"""Measures from the command to the written file what a picture takes: writes docs/results/first_picture.md.

    python benchmarks/first_picture.py [spot ...] [--sizes 512,256] [-o FILE]

Each picture is asked for twice, in processes of their own: first with no compiled programs on disk, then with those
that Mesa has kept of the first. Seconds are the processor's, of all threads, user and system: a busy machine does not
change them much.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from protocol import Page, machine


def seconds(command: list[str], cache: Path) -> float:
    """Run a command with Mesa's programs in the folder `cache`, and return the processor's seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=os.environ | {"MESA_SHADER_CACHE_DIR": str(cache)}, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Draw every picture twice, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", default=["spot"])
    parser.add_argument("--sizes", default="512,256", help="pixels per side, with commas between them")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/first_picture.md"))
    args = parser.parse_args()
    page = Page(
        args.output,
        "# The first picture",
        "",
        f"Printed by `python benchmarks/first_picture.py {' '.join(args.models)} --sizes {args.sizes}`: {machine()}. "
        "From the command to the written file, `mplicits render M --context osmesa`, the defaults otherwise (up to 16 "
        "samples of a pixel, Phong); seconds of the processor, all threads together, Python's start among them. First: "
        "no compiled programs are on disk. Second: Mesa's are. Where two cores are idle, drawing takes half as long by "
        "the clock; compiling does not.",
        "",
        "| model | size | first | second |",
        "| --- | ---: | ---: | ---: |",
    )
    for model in args.models:
        for size in args.sizes.split(","):
            with tempfile.TemporaryDirectory() as folder:
                shape = ["--size", size, "--context", "osmesa", "-o", str(Path(folder) / "picture.png")]
                command = [sys.executable, "-m", "mplicits", "render", model, *shape]
                first, second = (seconds(command, Path(folder) / "programs") for _ in range(2))
            page.add(f"| {model} | {size} x {size} | {first:.1f} | {second:.1f} |")


if __name__ == "__main__":
    main()
